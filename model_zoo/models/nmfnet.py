"""NMFNet (Nguyen et al., IROS 2020), made to predict success, and a variant with the trajectory.

Where the published network has one steering angle, these have T log-odds. Shapes: B scenes, K
candidate trajectories, T = 10 steps.
"""

from __future__ import annotations

import math
from typing import Annotated, ClassVar, NamedTuple, Self

import torch
from pydantic import Field, model_validator
from torch import Tensor, nn
from torch.nn.functional import conv2d, linear, pad, relu

from graspe_data.errors import ZooError
from graspe_data.manifest import Settings
from model_zoo.bounds import Beams, Metres, Points, Share, Shrink, Side, Steps, Units, Weight, Width
from model_zoo.contract import Features, Loss, Observation, SuccessModel, masked_cross_entropy
from model_zoo.layers.path_branch import PathBranch, check_path_rows
from model_zoo.layers.picture_input import laid_out, normalised_picture
from model_zoo.layers.point_input import bounded, choose_points, nearby_points
from model_zoo.layers.pointnet import PointNetSettings, PointNetTrunk, penalised
from model_zoo.layers.scan_input import expect_beams


class ResNet8(nn.Module):
    """DroNet's trunk (uzh-rpg/rpg_public_dronet, cnn_models.py; aioz-ai/FADNet has the same).

    A 5 x 5 convolution and a pooling, then three pre-activated residual blocks that each halve the
    picture. 240 x 320 becomes 8 x 10, 200 x 200 becomes 7 x 7. The 1e-4 that DroNet puts on the
    squared 3 x 3 kernels is left to the optimiser's weight decay.
    """

    def __init__(self, channels: int, width: int = 32) -> None:
        """Build it.

        Args:
            channels: Of the picture.
            width: Of the first block; the others have twice and four times as many.
        """
        super().__init__()
        self.width = width
        self.stem = nn.Sequential(SameConv2d(channels, width, 5, 2), nn.MaxPool2d(3, 2))
        self.blocks = nn.Sequential(
            _Block(width, width), _Block(width, 2 * width), _Block(2 * width, 4 * width)
        )

    def forward(self, picture: Tensor) -> Tensor:
        """Features (B, 4 width, h, w), not yet rectified, of pictures (B, channels, H, W)."""
        features: Tensor = self.blocks(self.stem(laid_out(picture, self.width)))
        return features

    @staticmethod
    def feature_size(height: int, width: int) -> tuple[int, int]:
        """Height and width of the features of a picture."""
        return _feature_length(height), _feature_length(width)


class SameConv2d(nn.Conv2d):
    """A convolution padded as TensorFlow's ``same``: an odd pixel goes to the right and below."""

    def __init__(self, channels: int, features: int, kernel: int, stride: int = 1) -> None:
        """A square kernel, with a bias; kernels of 3 start as He et al. draw them."""
        super().__init__(channels, features, kernel, stride)
        if kernel == 3:  # noqa: PLR2004 - DroNet draws these alone so
            nn.init.kaiming_normal_(self.weight)

    def forward(self, input: Tensor) -> Tensor:  # noqa: A002 - torch's name
        """Convolve (B, C, H, W) to (B, F, ceil(H / stride), ceil(W / stride))."""
        top, bottom = self._padding(input.shape[2])
        left, right = self._padding(input.shape[3])
        return super().forward(pad(input, (left, right, top, bottom)))

    def _padding(self, length: int) -> tuple[int, int]:
        kernel, stride = self.kernel_size[0], self.stride[0]
        missing = max(0, (_halved(length, stride) - 1) * stride + kernel - length)
        return missing // 2, missing - missing // 2


class _Block(nn.Module):
    """Normalise, rectify, convolve, twice; the shortcut takes the input as it came."""

    def __init__(self, before: int, after: int) -> None:
        super().__init__()
        self.residual = nn.Sequential(
            nn.BatchNorm2d(before),
            nn.ReLU(),
            SameConv2d(before, after, 3, 2),
            nn.BatchNorm2d(after),
            nn.ReLU(),
            SameConv2d(after, after, 3),
        )
        self.shortcut = nn.Conv2d(before, after, 1, 2)

    def forward(self, features: Tensor) -> Tensor:
        return torch.add(self.shortcut(features), self.residual(features))


def _halved(length: int, stride: int) -> int:
    return -(-length // stride)


def _feature_length(length: int) -> int:
    pooled = (_halved(length, 2) - 3) // 2 + 1
    return _halved(pooled, 8)


FREE, BLOCKED, UNSEEN = 1.0, 0.0, 0.5


class DistanceMap(nn.Module):
    """Raster scans into the half-plane ahead of the robot, which stands below the middle.

    The first row is the farthest, columns go from left to right; the sides of the square are as
    long as the view is deep. Each pixel looks up the ray in whose sector its centre lies
    (``polar_fill``): 1 in front of that ray's return, 0 at and behind it, 0.5 where the ray has
    none, since a ray without a return in its band of heights says nothing about the ground.
    How NMFNet draws its distance maps is not published; this rendering is ours.
    """

    ray: Tensor
    distance: Tensor

    def __init__(
        self, pixels: int, depth: float, beams: int, half_angle: float = math.pi / 2
    ) -> None:
        """Look up each pixel's ray, once.

        Args:
            pixels: Pixels of each side, P.
            depth: Metres ahead that the view reaches.
            beams: Rays of a scan, from right to left.
            half_angle: The scan covers [-half_angle, half_angle), rad.

        Raises:
            ZooError: The scan does not cover the half-plane ahead.
        """
        super().__init__()
        if half_angle < math.pi / 2:
            raise ZooError(
                f"distance map: the scan covers {2 * half_angle:.3f} rad, expected pi at least; "
                "fill the sides with inf first."
            )
        self.beams = beams
        ray, distance = _polar(pixels, depth / pixels, beams, half_angle)
        self.register_buffer("ray", ray, persistent=False)
        self.register_buffer("distance", distance, persistent=False)

    def forward(self, scan: Tensor) -> Tensor:
        """Draw scans (B, beams), metres, inf where empty: float32 (B, 1, P, P) of 0, 0.5, 1.

        Raises:
            ZooError: Another number of rays.
        """
        first = expect_beams(scan, self.beams)[:, self.ray]
        seen = torch.where(self.distance < first, FREE, BLOCKED)
        return torch.where(torch.isfinite(first), seen, UNSEEN).unsqueeze(1)


def _polar(pixels: int, cell: float, beams: int, half_angle: float) -> tuple[Tensor, Tensor]:
    """Each pixel centre's ray, int64 (P, P), and distance from the robot, (P, P) metres.

    The right half is the left one's mirror image, also where a centre lies between two rays.
    """
    steps = torch.arange(pixels, dtype=torch.float64) + 0.5
    x = (pixels - steps)[:, None] * cell
    y = (pixels / 2 - steps)[None, :] * cell
    sector = (torch.atan2(y.abs(), x) + half_angle) * (beams / (2 * half_angle))
    left = sector.floor().long().clamp(0, beams - 1)
    ray = torch.where(y > 0, left, beams - 1 - left)
    return ray, torch.hypot(x, y).float()


COLUMNS = ("image", "points", "point_count", "laser_scan")


class SceneSettings(Settings):
    """The sizes of NMFNet's branches.

    Attributes:
        picture_size: Rows and columns of the picture.
        shrink: Pixels of each side of the squares over which it is averaged first.
        width: Channels of the first block of either ResNet8.
        point_number: Points chosen of each cloud.
        point_reach: Metres around the robot within which they are chosen, as GrASPE's; None takes
            all.
        point_range: Metres at which the length of a point is taken in as 0.5; see ``bounded``.
        point_net: Sizes of the points' network, of which the trunk is used.
        fusion: Channels of the two 1x1 convolutions that join points and picture.
        beams: Rays of a scan over half a circle.
        map_pixels: Pixels of each side of the distance map.
        map_depth: Metres that it reaches ahead.
    """

    picture_size: tuple[Side, Side] = (240, 320)
    shrink: Shrink = 1
    width: Width = 32
    point_number: Points = 10_000
    point_reach: Metres | None = None
    point_range: Metres = 3.0
    point_net: PointNetSettings = PointNetSettings()
    fusion: tuple[Units, Units] = (256, 128)
    beams: Beams = 720
    map_pixels: Annotated[int, Field(strict=True, ge=8, le=2048)] = 200
    map_depth: Metres = 10.0


class SceneFeatures(NamedTuple):
    """The vector (B, F), and PointNet's feature transform (B, K, K) or None."""

    vector: Tensor
    transform: Tensor | None


class SceneBranches(nn.Module):
    """Picture and points are joined early, place by place; the map comes in at the end.

    After the authors' article on NMFNet: ResNet8 for the picture and for the map, PointNet for the
    points, two 1x1 convolutions. The network's code was never published, and the article states
    no sizes of the fusion; those here are ours.

    Attributes:
        length: Of the vector, F.
    """

    def __init__(self, settings: SceneSettings) -> None:
        """Make the branches with random weights.

        Raises:
            ZooError: The picture is too small.
        """
        super().__init__()
        self.settings = settings
        self.image = ResNet8(3, settings.width)
        self.point_net = PointNetTrunk(settings.point_net)
        last = settings.point_net.channels[-1]
        self.fusion = _PlacewiseFusion(4 * settings.width, last, settings.fusion)
        self.draw = DistanceMap(settings.map_pixels, settings.map_depth, settings.beams)
        self.map = ResNet8(1, settings.width)
        rows, columns = ResNet8.feature_size(
            *(side // settings.shrink for side in settings.picture_size)
        )
        if rows < 1 or columns < 1:
            raise ZooError(
                f"a picture of {settings.picture_size} shrunk by {settings.shrink} is too small: "
                "ResNet8 makes nothing of it. Take a larger one, or shrink it less."
            )
        map_side, _ = ResNet8.feature_size(settings.map_pixels, settings.map_pixels)
        self.length = settings.fusion[1] * rows * columns + 4 * settings.width * map_side**2

    def forward(self, observation: Observation) -> SceneFeatures:
        """The features of :data:`COLUMNS`."""
        settings = self.settings
        # ResNet8 of the picture, (B, 128, 8, 10).
        picture = relu(self.image(normalised_picture(observation["image"], settings.shrink)))
        # PointNet of the points, (B, 1024).
        points, count = observation["points"], observation["point_count"]
        if settings.point_reach is not None:
            points, count = nearby_points(points, count, settings.point_reach)
        chosen = choose_points(points, count, settings.point_number)
        cloud = self.point_net(bounded(chosen, settings.point_range))
        # ResNet8 of the distance map, (B, 128, 7, 7).
        near = relu(self.map(self.draw(observation["laser_scan"])))
        # Picture and points place by place, (B, 128, 8, 10); then all in a row, (B, F).
        fused = self.fusion(picture, cloud.vector)
        vector = torch.cat((fused.flatten(1), near.flatten(1)), dim=1)
        return SceneFeatures(vector, cloud.transform)


class _PlacewiseFusion(nn.Module):
    """A vector joined to each place of a feature map, then two 1x1 convolutions.

    Only the convolutions learn: with the default sizes, 328,064 parameters.
    """

    def __init__(self, maps: int, vector: int, channels: tuple[int, int]) -> None:
        super().__init__()
        first, second = channels
        self.maps = maps
        self.join = nn.Conv2d(maps + vector, first, 1)
        self.rest = nn.Sequential(
            nn.BatchNorm2d(first, affine=False),
            nn.ReLU(),
            nn.Conv2d(first, second, 1),
            nn.BatchNorm2d(second, affine=False),
            nn.ReLU(),
        )

    def forward(self, maps: Tensor, vector: Tensor) -> Tensor:
        """Join maps (B, M, h, w) and vectors (B, V).

        The vector is the same at every place, so that its part of the first convolution is
        computed once a row instead of once a place.
        """
        weight, bias = self.join.weight, self.join.bias
        everywhere = linear(vector, weight[:, self.maps :, 0, 0], bias)
        joined = conv2d(maps, weight[:, : self.maps]) + everywhere[:, :, None, None]
        fused: Tensor = self.rest(joined)
        return fused


class NmfnetSettings(SceneSettings):
    """The numbers of NMFNet.

    Attributes:
        horizon: Steps predicted, T.
        dropout: Of the scene's vector, before the last layer.
        orthogonality: Weight of the penalty on PointNet's feature transform, where it has one.
    """

    horizon: Steps = 10
    dropout: Share = 0.5
    orthogonality: Weight = 0.001


class NmfnetFamily(SuccessModel):
    """Branches for the scene, and a head that each variant brings."""

    def __init__(self, settings: NmfnetSettings) -> None:
        """Make the branches with random weights."""
        super().__init__()
        self.horizon = settings.horizon
        self.orthogonality = settings.orthogonality
        self.scene = SceneBranches(settings)

    def encode(self, scene: Observation) -> Features:
        """The scene's vector, (B, F)."""
        return {"scene_features": self.scene(scene).vector}

    def loss(self, observation: Observation, success: Tensor, mask: Tensor, weight: Tensor) -> Loss:
        """Cross-entropy of the judged steps, and the penalty on PointNet's feature transform."""
        vector, transform = self.scene(observation)
        logits = self.score_each({"scene_features": vector}, observation)
        entropy = masked_cross_entropy(logits, success, mask, weight)
        return penalised(Loss(entropy, logits), transform, self.orthogonality)


class Nmfnet(NmfnetFamily):
    """Variant A, the published network: it knows nothing of the trajectory.

    Whatever the candidate, it says how the motion under way will fare in this scene. So it can
    stop a robot, and not choose between candidates.
    """

    name = "nmfnet"
    settings_type = NmfnetSettings
    columns: ClassVar[tuple[str, ...]] = COLUMNS

    def __init__(self, settings: NmfnetSettings) -> None:
        """Make it with random weights."""
        super().__init__(settings)
        self.head = nn.Sequential(
            nn.Dropout(settings.dropout), nn.Linear(self.scene.length, settings.horizon)
        )

    def score(self, features: Features, candidates: Observation) -> Tensor:  # noqa: ARG002
        """Log-odds of success (B, T) from the scene's vector alone, whatever the candidates."""
        found: Tensor = self.head(features["scene_features"])
        return found


# --- Variant B: what differs from the published network ---


class NmfnetTrajectorySettings(NmfnetSettings):
    """The numbers of NMFNet with a branch for the path.

    Attributes:
        path_rows: Rows of the trajectory image that are read, from its lower edge.
        path_features: Length of the path's vector.
    """

    path_rows: Side = 128
    path_features: Units = 64

    @model_validator(mode="after")
    def _rows_of_the_picture(self) -> Self:
        check_path_rows(self.path_rows, self.picture_size[0])
        return self


class NmfnetTrajectory(NmfnetFamily):
    """Variant B, ours, a stronger control: PAAD's branch for the path joins at the last layer."""

    name = "nmfnet_trajectory"
    settings_type = NmfnetTrajectorySettings
    columns: ClassVar[tuple[str, ...]] = (*COLUMNS, "trajectory_image")
    candidate_columns: ClassVar[tuple[str, ...]] = ("trajectory_image",)

    def __init__(self, settings: NmfnetTrajectorySettings) -> None:
        """Make it with random weights."""
        super().__init__(settings)
        rows, features = settings.path_rows, settings.path_features
        self.path = PathBranch(rows, settings.picture_size[1], settings.shrink, features)
        self.dropout = nn.Dropout(settings.dropout)
        self.last = nn.Linear(self.scene.length + features, settings.horizon)

    def score(self, features: Features, candidates: Observation) -> Tensor:
        """Log-odds of success (K, T) from the scene's vector and the trajectory image.

        The last layer reads both side by side; the scene's part of it is computed once a scene.
        """
        vector = self.dropout(features["scene_features"])
        path = self.path(candidates["trajectory_image"])
        weight, bias, length = self.last.weight, self.last.bias, self.scene.length
        return linear(vector, weight[:, :length], bias) + linear(path, weight[:, length:])
