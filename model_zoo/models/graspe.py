"""GrASPE (Weerakoon et al., RA-L) and its ablations, beside the paper from top to bottom.

Shapes: B rows, K candidate trajectories, N = 120 nodes, T = 10 steps. What is ours and not printed
is said so in the settings.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterable
from functools import reduce
from itertools import pairwise
from typing import Annotated, ClassVar, NamedTuple, cast

import torch
from pydantic import Field
from torch import Tensor, nn
from torch.nn.functional import conv2d, elu, embedding_bag, leaky_relu, pad

from graspe_data.errors import ZooError
from graspe_data.manifest import Settings
from model_zoo.bounds import (
    NO_TRUTH,
    Heads,
    Kernel,
    Metres,
    Points,
    Share,
    Shrink,
    Side,
    Steps,
    Units,
    Weight,
    Width,
)
from model_zoo.contract import Features, Loss, Observation, SuccessModel, masked_cross_entropy
from model_zoo.layers.picture_input import normalised_picture, shrunk_drawing
from model_zoo.layers.point_input import bounded, choose_points, nearby_points
from model_zoo.layers.pointnet import PointNet, PointNetSettings, penalised
from model_zoo.layers.resnet18 import ResNet18

COLUMNS = ("image", "points", "point_count", "velocity_history", "trajectory_image")


class FeatureCounts(NamedTuple):
    """How many nodes come from each sensor, in the order of the feature vector f_vec."""

    image: int = 40
    point: int = 40
    trajectory: int = 20
    velocity: int = 20

    @property
    def nodes(self) -> int:
        """N, 120 as printed."""
        return sum(self)


# --- Section IV-B: encoders ---


DILATIONS = (3, 2, 2, 2)


class VelocityNetSettings(Settings):
    """The sizes of a VelNet.

    Kernel 11 and 2 last channels are ours: with the printed dilations, stride 1 and no padding they
    are the odd kernel that takes 100 numbers to 2 x 10, the 20 features printed.

    Attributes:
        steps: Of the history.
        channels: Of the four convolutions.
        kernel: Of each of them.
    """

    steps: Steps = 50
    channels: tuple[Width, Width, Width, Width] = (8, 16, 8, 2)
    kernel: Kernel = 11


class VelocityNet(nn.Module):
    """Histories (B, steps, 2) of (v, w) to ``outputs`` numbers each, not activated."""

    def __init__(self, outputs: int, settings: VelocityNetSettings) -> None:
        """Make the convolutions.

        Raises:
            ZooError: The sizes do not give ``outputs`` numbers.
        """
        super().__init__()
        length = 2 * settings.steps - (settings.kernel - 1) * sum(DILATIONS)
        if length < 1 or length * settings.channels[-1] != outputs:
            raise ZooError(
                f"VelNet: {settings.steps} steps, kernel {settings.kernel} and "
                f"{settings.channels[-1]} last channels give {max(length, 0)} x "
                f"{settings.channels[-1]} numbers, expected {outputs}; change one of them."
            )
        pairs = zip(pairwise((1, *settings.channels)), DILATIONS, strict=True)
        self.convolutions = nn.Sequential(
            *(nn.Conv1d(*pair, settings.kernel, dilation=dilation) for pair, dilation in pairs)
        )
        self.apply(_initialise)

    def forward(self, history: Tensor) -> Tensor:
        """The numbers (B, outputs); V_t is the history with v and w in turn."""
        return self.convolutions(history.flatten(1)[:, None]).flatten(1)  # type: ignore[no-any-return]


def _initialise(module: nn.Module) -> None:
    """Weights that keep the variance where no activation follows."""
    if isinstance(module, nn.Conv1d):
        nn.init.kaiming_normal_(module.weight, nonlinearity="linear")


_WINDOWED = 6
"""Layers up to the map of which each place sees a window of its own."""


class TrajectoryNetSettings(Settings):
    """The sizes of a TrajNet.

    Kernels 3, 2, 2 are printed; strides, padding and one last channel are what takes 240 x 320 to
    4 x 5, the 20 features printed.

    Attributes:
        channels: Of the first two convolutions; the third has one.
        first_stride: Of the first convolution: 2, or 1 for pictures of half the size.
    """

    channels: tuple[Width, Width] = (8, 16)
    first_stride: Annotated[int, Field(strict=True, ge=1, le=4)] = 2


class TrajectoryNet(nn.Module):
    """Pictures (B, H, W), 1 on the trajectory, to ``outputs`` numbers each, not activated.

    Its first weights are torch's, made positive, and its first biases 0 (ours): so a line passes
    all layers, and what comes out says where it runs. Drawn with both signs, most outputs begin
    rectified away or alike for all lines, and thousands of steps do not tell left from right.
    """

    def __init__(
        self, outputs: int, size: tuple[int, int], settings: TrajectoryNetSettings
    ) -> None:
        """Make the layers for pictures of ``size`` (H, W).

        Raises:
            ZooError: Pictures of that size do not give ``outputs`` numbers.
        """
        super().__init__()
        first, second = settings.channels
        self.layers = nn.Sequential(
            nn.Conv2d(1, first, 3, stride=settings.first_stride, padding=1),
            nn.MaxPool2d(2),
            nn.ReLU(),
            nn.Conv2d(first, second, 2, stride=2),
            nn.MaxPool2d(2),
            nn.ReLU(),
            nn.Conv2d(second, 1, 2, stride=2, padding=1),
            nn.MaxPool2d(2),
            nn.Flatten(),
        )
        height, width = (_length(side, settings.first_stride) for side in size)
        if height * width != outputs:
            raise ZooError(
                f"TrajNet: trajectory images of {size[0]} x {size[1]} with first stride "
                f"{settings.first_stride} give {height} x {width} numbers, expected {outputs}; "
                f"240 x 320 with stride 2 and 120 x 160 with stride 1 give 4 x 5."
            )
        self._let_lines_pass()

    @torch.no_grad()
    def _let_lines_pass(self) -> None:
        for layer in self.layers:
            if isinstance(layer, nn.Conv2d) and layer.bias is not None:
                layer.weight.abs_()
                layer.bias.zero_()

    def forward(self, picture: Tensor) -> Tensor:
        """The numbers (B, outputs), row by row of the last map.

        In training only what differs of the windows that the line crosses is computed; the result
        is the same, for pictures of 0 and 1.
        """
        maps = self._crossed_windows(picture) if self.training else self._all_windows(picture)
        return self.layers[_WINDOWED:](maps)  # type: ignore[no-any-return]

    def _all_windows(self, picture: Tensor) -> Tensor:
        """The map (B, second, h, w) before the last convolution.

        Channels lie last, which on a CPU takes less than half the time.
        """
        drawing = picture[:, None].to(memory_format=torch.channels_last)
        return self.layers[:_WINDOWED](drawing)  # type: ignore[no-any-return]

    def _crossed_windows(self, picture: Tensor) -> Tensor:
        """The same map: each of its places sees one window, and all empty windows look alike."""
        stride = self._first.stride[0]
        side, step = 7 * stride + 3, 8 * stride
        rows = pad(picture, (1, 1, 1, 1)).unfold(1, side, step)
        columns = reduce(torch.maximum, rows.unbind(3)).unfold(2, side, step)
        crossed = reduce(torch.maximum, columns.unbind(3)) > 0
        kept = rows.unfold(2, side, step)[crossed]
        features = self._features(torch.cat((kept, kept.new_zeros(1, side, side))))
        flat = crossed.flatten()
        place = torch.where(flat, flat.cumsum(0) - 1, len(kept))
        return features[place].view(*crossed.shape, -1).permute(0, 3, 1, 2)

    def _features(self, windows: Tensor) -> Tensor:
        """What the windows (N, side, side) become, (N, second).

        The four places of a window, and in each the four of the second convolution's kernel, see a
        patch of the line each. There are a few hundred patches: the convolutions are done for
        those, and the windows look up and add what each patch contributes.
        """
        second = cast("nn.Conv2d", self.layers[3])
        patches, known = _different_patches(windows, self._first.stride[0])
        seen = conv2d(patches, self._first.weight, self._first.bias, self._first.stride)
        features: Tensor = self.layers[1:3](seen).flatten(1)
        shares = torch.einsum("pc,ockl->klpo", features, second.weight).flatten(0, 2)
        kernel = known.view(-1, 2, 2, 2, 2).permute(0, 1, 3, 2, 4).reshape(-1, 4)
        row = kernel + len(patches) * torch.arange(4, device=kernel.device)
        sums = embedding_bag(row, shares, mode="sum").view(len(windows), 4, -1)
        return torch.relu(sums.amax(1) + cast("Tensor", second.bias))

    @property
    def _first(self) -> nn.Conv2d:
        return cast("nn.Conv2d", self.layers[0])


def _different_patches(windows: Tensor, stride: int) -> tuple[Tensor, Tensor]:
    """What the 4 x 4 places after the first pooling see of windows (N, side, side) of 0 and 1.

    Returns:
        The P patches that differ, float32 (P, 1, n, n); which of them each place sees, (N, 4, 4).
    """
    side, step = stride + 3, 2 * stride
    columns = windows.to(torch.int32).unfold(2, side, step).unbind(3)
    rows = reduce(torch.add, (column << i for i, column in enumerate(columns))).long()
    codes = (row << i * side for i, row in enumerate(rows.unfold(1, side, step).unbind(3)))
    known, place = torch.unique(reduce(torch.add, codes), return_inverse=True)
    bit = torch.arange(side * side, device=known.device)
    patches = (known[:, None] >> bit & 1).to(windows.dtype)
    return patches.view(-1, 1, side, side), place


def _length(side: int, first_stride: int) -> int:
    """The side of the last map: each formula is that of one convolution and its pooling."""
    side = ((side - 1) // first_stride + 1) // 2
    side = side // 2 // 2
    return (side // 2 + 1) // 2


class SensorEncoderSettings(Settings):
    """The sizes of the four encoders.

    Attributes:
        picture_size: Height and width of the pictures in the dataset.
        shrink: Pixels a side that become one, in both pictures, before anything else.
        image_width: Channels of ResNet18's first stage.
        image_reduction: Of its attention's MLP.
        point_number: Points of a cloud that are looked at.
        point_reach: Metres around the robot, horizontally, within which points are looked at; None
            looks at all. Ours: a robot goes less than 2 m within the horizon.
        point_range: Metres at which the length of a point is taken in as 0.5; see ``bounded``.
        points: PointNet.
        velocity: VelNet.
        trajectory: TrajNet.
        normalise: Whether f_vec is batch-normalised before its sigmoid. Ours: without it features
            hardly leave 0.5 at first, all edges weigh the same, and training does not begin.
    """

    picture_size: tuple[Side, Side] = (240, 320)
    shrink: Shrink = 1
    image_width: Width = 64
    image_reduction: Units = 16
    point_number: Points = 10_000
    point_reach: Metres | None = None
    point_range: Metres = 3.0
    points: PointNetSettings = PointNetSettings()
    velocity: VelocityNetSettings = VelocityNetSettings()
    trajectory: TrajectoryNetSettings = TrajectoryNetSettings()
    normalise: bool = True


class SensorFeatures(NamedTuple):
    """f_vec, (B, 120) within 0 and 1, and PointNet's feature transform or None."""

    vector: Tensor
    transform: Tensor | None


class SceneEncoding(NamedTuple):
    """The scene's part of f_vec by sensor, not yet normalised, and PointNet's transform or None."""

    features: Features
    transform: Tensor | None


class SensorEncoders(nn.Module):
    """An observation to f_vec: features of picture, points, trajectory and velocities, in a row."""

    def __init__(self, settings: SensorEncoderSettings, counts: FeatureCounts) -> None:
        """Make the four encoders, with ``counts`` outputs."""
        super().__init__()
        self.settings = settings
        height, width = (side // settings.shrink for side in settings.picture_size)
        self.image = ResNet18(counts.image, settings.image_width, settings.image_reduction)
        self.points = PointNet(counts.point, settings.points)
        self.trajectory = TrajectoryNet(counts.trajectory, (height, width), settings.trajectory)
        self.velocity = VelocityNet(counts.velocity, settings.velocity)
        self.norm = nn.BatchNorm1d(counts.nodes) if settings.normalise else nn.Identity()

    def forward(self, observation: Observation) -> SensorFeatures:
        """The features, all past one sigmoid."""
        features, transform = self.scene(observation)
        return SensorFeatures(self.join(features, observation["trajectory_image"]), transform)

    def scene(self, observation: Observation) -> SceneEncoding:
        """What all trajectories in a scene share: features of picture, points and velocities."""
        # Points: those near, always as many (B, 10000, 3), lengths within 0 and 1.
        points, count = observation["points"], observation["point_count"]
        if self.settings.point_reach is not None:
            points, count = nearby_points(points, count, self.settings.point_reach)
        chosen = choose_points(points, count, self.settings.point_number)
        cloud = self.points(bounded(chosen, self.settings.point_range))
        # f_img (B, 40), f_point (B, 40), f_vel (B, 20), before their sigmoid.
        features = {
            "image_features": self.image(
                normalised_picture(observation["image"], self.settings.shrink)
            ),
            "point_features": cloud.vector,
            "velocity_features": self.velocity(observation["velocity_history"]),
        }
        return SceneEncoding(features, cloud.transform)

    def join(self, features: Features, trajectory_image: Tensor) -> Tensor:
        """f_vec (K, 120) of K trajectory images (K, H, W) in as many scenes, or in one."""
        rows = trajectory_image.shape[0]
        image, point, velocity = (
            features[name].expand(rows, -1)
            for name in ("image_features", "point_features", "velocity_features")
        )
        # f_traj (K, 20).
        drawing = shrunk_drawing(trajectory_image, self.settings.shrink)
        trajectory = self.trajectory(drawing)
        # Section IV-D: f_vec = [f_img, f_point, f_traj, f_vel], (K, 120), within 0 and 1.
        joined = torch.cat((image, point, trajectory, velocity), dim=1)
        return torch.sigmoid(self.norm(joined.float()))


# --- Section IV-D: the reliability-aware feature graph, equations (6) and (7) ---


class ReliabilityGraph(nn.Module):
    """Features (B, N) and reliabilities (B,) to the weights (B, N, N) of a complete graph.

    What does not depend on the observation is kept as a constant, so that r_ij of a whole batch is
    one matrix product.
    """

    rates: Tensor

    def __init__(self, counts: FeatureCounts, decay: float) -> None:
        """Prepare the graph.

        Args:
            counts: Nodes of each sensor.
            decay: Lambda of equation (6), above 0.
        """
        super().__init__()
        self.nodes = counts.nodes
        pattern = _pattern(counts)
        # -lambda (2 - r_ij) is a share of r_img, r_point and 1 as well.
        rates = decay * (pattern - torch.tensor([[0.0], [0.0], [2.0]]))
        self.register_buffer("rates", rates, persistent=False)

    def forward(self, features: Tensor, r_img: Tensor, r_point: Tensor) -> Tensor:
        """W + I of equation (6): exp(-lambda |f_i - f_j| (2 - r_ij)), which is 1 where i = j."""
        # |f_i - f_j|, (B, N, N).
        distance = (features[:, :, None] - features[:, None, :]).abs_()
        # Equation (7) within (6): times -lambda (2 - r_ij).
        sources = torch.stack([r_img, r_point, torch.ones_like(r_img)], dim=1)
        rates = (sources @ self.rates).view(-1, self.nodes, self.nodes)
        return distance.mul_(rates).exp_()


def _pattern(counts: FeatureCounts) -> Tensor:
    """The shares (3, N * N) of r_img, r_point and 1 in every r_ij."""
    sensor = torch.repeat_interleave(torch.arange(4), torch.tensor(counts))
    is_image, is_point = sensor == 0, sensor == 1
    image = is_image[:, None] | is_image[None]
    point = is_point[:, None] | is_point[None]
    # A node cannot be both, so image & point is a pair of one image and one point node.
    between = (image & point) * 0.5
    parts = [(image & ~point) + between, (point & ~image) + between, ~(image | point) * 1.0]
    return torch.stack(parts).flatten(1)


# --- Section IV-E: A-GNN ---


class DenseGcn(nn.Module):
    """H' = D^-1/2 (W + I) D^-1/2 H Theta + b, D the row sums of W + I.

    On a batch of graphs of N nodes it gives what PyTorch Geometric's ``GCNConv`` gives on their
    edge lists with edge weights; parameters are named as there, so its state dict loads.
    """

    def __init__(self, inputs: int, outputs: int) -> None:
        """Make Theta and b."""
        super().__init__()
        self.lin = nn.Linear(inputs, outputs, bias=False)
        self.bias = nn.Parameter(torch.zeros(outputs))
        nn.init.xavier_uniform_(self.lin.weight)

    def forward(self, x: Tensor, adjacency: Tensor, scale: Tensor) -> Tensor:
        """The nodes' new features (B, N, outputs).

        Args:
            x: The nodes' features (B, N, inputs).
            adjacency: W + I, symmetric, (B, N, N).
            scale: What :func:`degree_scale` gives for it.
        """
        if self.lin.in_features < self.lin.out_features:
            mixed: Tensor = self.lin(_propagate(x, adjacency, scale))
        else:
            mixed = _propagate(self.lin(x), adjacency, scale)
        return mixed + self.bias


def degree_scale(adjacency: Tensor) -> Tensor:
    """The diagonal of D^-1/2, (B, N, 1), from W + I, (B, N, N)."""
    return torch.rsqrt(adjacency.sum(2, keepdim=True))


def _propagate(x: Tensor, adjacency: Tensor, scale: Tensor) -> Tensor:
    """D^-1/2 (W + I) D^-1/2 H, transposed within: few rows multiply faster than few columns."""
    return torch.bmm((x * scale).mT, adjacency).mT * scale


NEGATIVE_SLOPE = 0.2
AT_ONCE = 4
"""Graphs whose scores are made at once: those of 120 nodes and 4 heads fit a core's cache."""


class DenseGat(nn.Module):
    """Multi-head attention of every node to all nodes, the edge's weight a term of its score.

    On a batch of complete graphs of N nodes it gives what PyTorch Geometric's
    ``GATConv(edge_dim=1, add_self_loops=True, fill_value="mean")`` gives on their edge lists;
    parameters are named as there, so its state dict loads. The scores, (heads, N, N) a graph, are
    the largest tensor: the edge's term is a scalar, so edges are never projected.
    """

    def __init__(self, inputs: int, channels: int, heads: int) -> None:
        """Make the heads; their outputs are concatenated, heads x channels a node."""
        super().__init__()
        self.heads = heads
        self.lin = nn.Linear(inputs, heads * channels, bias=False)
        self.lin_edge = nn.Linear(1, heads * channels, bias=False)
        self.att_src, self.att_dst, self.att_edge = (
            nn.Parameter(torch.empty(1, heads, channels)) for _ in range(3)
        )
        self.bias = nn.Parameter(torch.zeros(heads * channels))
        for weight in (self.lin, self.lin_edge):
            nn.init.xavier_uniform_(weight.weight)
        for vector in (self.att_src, self.att_dst, self.att_edge):
            nn.init.xavier_uniform_(vector.data[0])

    def focus(self, most: float) -> None:
        """Begin with heads that look at all nodes, ever nearer ones, and the nearest alone.

        Args:
            most: By how much, in nats, the last head's score of a node of weight 1 is above that of
                a node of weight 0; the first head's are alike, those between lie evenly.
        """
        channels = self.att_edge.shape[2]
        scores = torch.linspace(0, most, self.heads) if self.heads > 1 else torch.tensor([most])
        share = (scores / channels).sqrt()[:, None].expand(-1, channels)
        with torch.no_grad():
            self.att_edge.copy_(share[None])
            self.lin_edge.weight.copy_(share.reshape(-1, 1))

    def forward(self, x: Tensor, adjacency: Tensor) -> Tensor:
        """The nodes' new features (B, N, heads x channels).

        Args:
            x: The nodes' features (B, N, inputs).
            adjacency: W + I, the edges' weights with 1 on the diagonal, (B, N, N).
        """
        rows, nodes, _ = x.shape
        hidden: Tensor = self.lin(x).view(rows, nodes, self.heads, -1).transpose(1, 2)
        target = hidden @ self.att_dst.unsqueeze(3)
        source = (hidden @ self.att_src.unsqueeze(3)).mT
        edge = (self.lin_edge.weight.view_as(self.att_edge) * self.att_edge).sum(2)[
            :, :, None, None
        ]
        graphs = (target, source, _with_self_loops(adjacency)[:, None], hidden)
        mixed = torch.cat([_attend(edge, *some) for some in _parts(graphs)])
        return mixed.flatten(1, 2).mT + self.bias


def _parts(graphs: tuple[Tensor, ...]) -> Iterable[tuple[Tensor, ...]]:
    """A few graphs at a time; all at once while exporting, when their number is not known."""
    if torch.compiler.is_compiling():
        return [graphs]
    return zip(*(torch.split(each, AT_ONCE) for each in graphs), strict=True)


def _attend(
    edge: Tensor, target: Tensor, source: Tensor, weights: Tensor, hidden: Tensor
) -> Tensor:
    """hidden^T @ softmax(scores)^T: how much node i (axis 2) attends to node j (axis 3).

    In place, for the scores' size; transposed, since MKL multiplies few rows by many columns up to
    five times faster.
    """
    scores = (target + source).addcmul_(weights, edge)
    scores = leaky_relu(scores, NEGATIVE_SLOPE, inplace=True)
    return hidden.mT @ torch.softmax(scores, 3).mT


def _with_self_loops(adjacency: Tensor) -> Tensor:
    """W whose diagonal is the mean of the other weights in the row, (B, N, N)."""
    nodes = adjacency.shape[1]
    mean = (adjacency.sum(2, keepdim=True) - 1) / (nodes - 1)
    return torch.addcmul(adjacency, torch.eye(nodes, device=adjacency.device), mean - 1)


class AttentionGraphSettings(Settings):
    """The sizes of an A-GNN. Only the first layer's 16 channels are printed.

    Attributes:
        decay: Lambda of equation (6); it is not printed. Ours is the best of 2, 5, 20, 80: every
            two nodes have an edge, which with small lambda makes all nodes alike, layer by layer,
            and with large lambda passes little on.
        focus: How much its last head's attention prefers an edge of weight 1 to one of weight 0 at
            first, in nats; ours, for the same reason. None draws it as the others.
        channels: Of both graph convolutions.
        heads: Of the attention.
        head_channels: Of each of its heads.
        dropout: After the attention.
        hidden: Of the first of two dense layers.
        normalise: Whether the nodes are batch-normalised before the dense layers. Ours: what tells
            one trajectory from another in a scene reaches them a hundred times smaller than what
            tells scenes apart, and is not learned.
    """

    decay: Annotated[float, Field(gt=0, le=1000), NO_TRUTH] = 5.0
    focus: Annotated[float, Field(ge=0, le=100), NO_TRUTH] | None = 12.0
    channels: Width = 16
    heads: Heads = 4
    head_channels: Width = 4
    dropout: Share = 0.5
    hidden: Units = 128
    normalise: bool = True


class AttentionGraphNetwork(nn.Module):
    """Features of 120 nodes and two reliabilities to ``outputs`` numbers, not activated."""

    def __init__(
        self, outputs: int, settings: AttentionGraphSettings, counts: FeatureCounts | None = None
    ) -> None:
        """Make the layers: GCN, GAT, dropout, GCN, two dense ones."""
        super().__init__()
        counts = counts or FeatureCounts()
        attended = settings.heads * settings.head_channels
        self.graph = ReliabilityGraph(counts, settings.decay)
        self.first = DenseGcn(1, settings.channels)
        self.attention = DenseGat(settings.channels, settings.head_channels, settings.heads)
        if settings.focus is not None:
            self.attention.focus(settings.focus)
        self.dropout = nn.Dropout(settings.dropout)
        self.second = DenseGcn(attended, settings.channels)
        flat = counts.nodes * settings.channels
        self.norm = nn.BatchNorm1d(flat) if settings.normalise else nn.Identity()
        self.head = nn.Sequential(
            nn.Linear(flat, settings.hidden),
            nn.ReLU(),
            nn.Linear(settings.hidden, outputs),
        )

    def forward(self, features: Tensor, r_img: Tensor, r_point: Tensor) -> Tensor:
        """The numbers (B, outputs); arguments as of `propagate`."""
        return self.read_out(self.propagate(features, r_img, r_point))

    def propagate(self, features: Tensor, r_img: Tensor, r_point: Tensor) -> Tensor:
        """What the nodes hold after the graph's layers, (B, N, channels).

        Args:
            features: f_vec, (B, N), within 0 and 1.
            r_img: Reliability of the picture, (B,).
            r_point: Reliability of the points, (B,).
        """
        # Equations (6), (7): W + I, (B, N, N), and D^-1/2 of it.
        adjacency = self.graph(features, r_img, r_point)
        scale = degree_scale(adjacency)
        # GCN: every node's one feature becomes 16, (B, N, 16).
        nodes = torch.relu(self.first(features[:, :, None], adjacency, scale))
        # GAT: 4 heads of 4 channels side by side, (B, N, 16); then dropout.
        nodes = self.dropout(elu(self.attention(nodes, adjacency)))
        # GCN, (B, N, 16).
        return torch.relu(self.second(nodes, adjacency, scale))

    def read_out(self, nodes: Tensor, gate: Tensor | None = None) -> Tensor:
        """All nodes in a row, (B, 16 N), and two dense layers, (B, T).

        Args:
            nodes: (B, N, channels).
            gate: How much of each normalised node is read, (B, N); None reads all. Not GrASPE's.
        """
        flat = self.norm(nodes.flatten(1))
        if gate is not None:
            flat = (flat.view_as(nodes) * gate[:, :, None]).flatten(1)
        return self.head(flat)  # type: ignore[no-any-return]


# --- The model ---


class GraspeFamilySettings(Settings):
    """What every model of the family can set.

    Attributes:
        horizon: Steps predicted, T.
        encoders: The four encoders.
        orthogonality: Weight of the penalty on PointNet's feature transform, where it has one.
    """

    horizon: Steps = 10
    encoders: SensorEncoderSettings = SensorEncoderSettings()
    orthogonality: Weight = 0.001


class GraspeFamily(SuccessModel):
    """Four encoders, and a fusion of their features that each model brings."""

    def __init__(self, settings: GraspeFamilySettings) -> None:
        """Make the encoders."""
        super().__init__()
        self.settings = settings
        self.horizon = settings.horizon
        self.counts = FeatureCounts()
        self.encoders = SensorEncoders(settings.encoders, self.counts)

    @abstractmethod
    def fuse(self, vector: Tensor, candidates: Observation) -> Tensor:
        """Log-odds of success (K, T) from f_vec, (K, 120)."""

    def encode(self, scene: Observation) -> Features:
        """The features of picture, points and velocities."""
        return self.encoders.scene(scene).features

    def score(self, features: Features, candidates: Observation) -> Tensor:
        """Log-odds of success (K, T)."""
        return self.fuse(self.encoders.join(features, candidates["trajectory_image"]), candidates)

    def loss(self, observation: Observation, success: Tensor, mask: Tensor, weight: Tensor) -> Loss:
        """Cross-entropy of the judged steps, and the penalty on PointNet's feature transform."""
        features, transform = self.encoders.scene(observation)
        logits = self.score_each(features, observation)
        entropy = masked_cross_entropy(logits, success, mask, weight)
        return penalised(Loss(entropy, logits), transform, self.settings.orthogonality)


class GraspeSettings(GraspeFamilySettings):
    """The numbers of GrASPE.

    Attributes:
        graph: A-GNN.
    """

    graph: AttentionGraphSettings = AttentionGraphSettings()


class Graspe(GraspeFamily):
    """GrASPE (Weerakoon et al., RA-L), section IV."""

    name = "graspe"
    settings_type = GraspeSettings
    columns: ClassVar[tuple[str, ...]] = (*COLUMNS, "r_img", "r_point")
    candidate_columns: ClassVar[tuple[str, ...]] = ("trajectory_image", "r_img", "r_point")

    def __init__(self, settings: GraspeSettings) -> None:
        """Make the model with random weights."""
        super().__init__(settings)
        self.graph = AttentionGraphNetwork(settings.horizon, settings.graph, self.counts)

    def fuse(self, vector: Tensor, candidates: Observation) -> Tensor:
        """Log-odds of success (K, T) by A-GNN."""
        return self.graph(vector, candidates["r_img"], candidates["r_point"])  # type: ignore[no-any-return]


# --- Ablations: what differs from GrASPE, and nothing else ---


class GraspeNoReliability(Graspe):
    """The ablation "GrASPE w/o reliability": r_ij = 1 for all pairs in equation (6)."""

    name = "graspe_no_reliability"
    columns = COLUMNS
    candidate_columns = ("trajectory_image",)

    def fuse(self, vector: Tensor, candidates: Observation) -> Tensor:  # noqa: ARG002
        """Log-odds of success (K, T) by A-GNN, every sensor as reliable as can be."""
        reliable = vector.new_ones(1)
        return self.graph(vector, reliable, reliable)  # type: ignore[no-any-return]


class ConvolutionSettings(Settings):
    """The sizes of the layers in A-GNN's place.

    Only "a set of 1D convolution layers" is printed. There are three, of A-GNN's width, with its
    dropout and its dense layers, so that the graph alone is what the ablation takes away.

    Attributes:
        channels: Of the three convolutions.
        kernel: Of each; the length is kept.
        dropout: After the second.
        hidden: Of the first of two dense layers.
        normalise: As A-GNN's.
    """

    channels: Width = 16
    kernel: Kernel = 3
    dropout: Share = 0.5
    hidden: Units = 128
    normalise: bool = True


class GraspeNoAgnnSettings(GraspeFamilySettings):
    """The numbers of GrASPE without A-GNN.

    Attributes:
        convolutions: The layers in A-GNN's place.
    """

    convolutions: ConvolutionSettings = ConvolutionSettings()


class GraspeNoAgnn(GraspeFamily):
    """The ablation "GrASPE w/o A-GNN": f_vec into convolutions along it."""

    name = "graspe_no_agnn"
    settings_type = GraspeNoAgnnSettings
    columns = COLUMNS
    candidate_columns = ("trajectory_image",)

    def __init__(self, settings: GraspeNoAgnnSettings) -> None:
        """Make the model with random weights."""
        super().__init__(settings)
        sizes = settings.convolutions
        self.convolutions = _convolutions(sizes)
        flat = self.counts.nodes * sizes.channels
        self.norm = nn.BatchNorm1d(flat) if sizes.normalise else nn.Identity()
        self.head = nn.Sequential(
            nn.Linear(flat, sizes.hidden),
            nn.ReLU(),
            nn.Linear(sizes.hidden, settings.horizon),
        )

    def fuse(self, vector: Tensor, candidates: Observation) -> Tensor:  # noqa: ARG002
        """Log-odds of success (K, T) by convolutions along f_vec."""
        return self.head(self.norm(self.convolutions(vector[:, None]).flatten(1)))  # type: ignore[no-any-return]


def _convolutions(settings: ConvolutionSettings) -> nn.Sequential:
    width, kernel = settings.channels, settings.kernel
    return nn.Sequential(
        nn.Conv1d(1, width, kernel, padding="same"),
        nn.ReLU(),
        nn.Conv1d(width, width, kernel, padding="same"),
        nn.ReLU(),
        nn.Dropout(settings.dropout),
        nn.Conv1d(width, width, kernel, padding="same"),
        nn.ReLU(),
    )
