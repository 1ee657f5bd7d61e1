"""PointNet (Qi et al., CVPR 2017), in the form of fxia22's pointnet.pytorch."""

from __future__ import annotations

from collections.abc import Sequence
from functools import reduce
from itertools import pairwise
from typing import NamedTuple

import torch
from torch import Tensor, nn

from graspe_data.manifest import Settings
from model_zoo.bounds import Points, Share, Units
from model_zoo.contract import Loss
from model_zoo.layers.normalised_maximum import normalised_maximum


class PointNetSettings(Settings):
    """The sizes of a PointNet.

    Attributes:
        channels: Of the three shared layers; the last is the length of the global feature.
        hidden: Of the two dense layers after it.
        align_input: Whether a 3x3 transform of the points is learned.
        align_features: Whether a transform of the first layer's features is learned.
        dropout: After the second dense layer.
        chunk: Points whose activations are held at once outside training.
    """

    channels: tuple[Units, Units, Units] = (64, 128, 1024)
    hidden: tuple[Units, Units] = (512, 256)
    align_input: bool = True
    align_features: bool = True
    dropout: Share = 0.3
    chunk: Points = 1024


class PointFeatures(NamedTuple):
    """What the trunk finds: the global feature (B, C), the feature transform (B, K, K) or None."""

    vector: Tensor
    transform: Tensor | None


class PointNetTrunk(nn.Module):
    """Points (B, N, 3) to one feature each cloud, whatever their order."""

    def __init__(self, settings: PointNetSettings) -> None:
        """Make the shared layers and the transforms that are asked for."""
        super().__init__()
        first, second, last = settings.channels
        shape = (settings.channels, settings.hidden, settings.chunk)
        self.align_input = _Alignment(3, *shape) if settings.align_input else None
        self.first = PointwiseStack((3, first))
        self.align_features = _Alignment(first, *shape) if settings.align_features else None
        self.rest = PointwiseMaximum((first, second, last), settings.chunk, last_relu=False)

    def forward(self, points: Tensor) -> PointFeatures:
        """The features of clouds (B, N, 3)."""
        if self.align_input is not None:
            points = points @ self.align_input(points)
        features = self.first(points)
        transform = None
        if self.align_features is not None:
            transform = self.align_features(features)
            features = features @ transform
        return PointFeatures(self.rest(features), transform)


class PointNet(nn.Module):
    """Points (B, N, 3) to ``outputs`` numbers each cloud, not activated."""

    def __init__(self, outputs: int, settings: PointNetSettings) -> None:
        """Make the trunk and three dense layers."""
        super().__init__()
        self.trunk = PointNetTrunk(settings)
        self.head = _head(settings.channels[-1], settings.hidden, outputs, settings.dropout)

    def forward(self, points: Tensor) -> PointFeatures:
        """The outputs (B, outputs), and the feature transform where there is one."""
        features = self.trunk(points)
        return PointFeatures(self.head(features.vector), features.transform)


def orthogonality_penalty(transform: Tensor) -> Tensor:
    """The mean over B of the Frobenius norm of A A^T - I, a scalar; A is (B, K, K)."""
    identity = torch.eye(transform.shape[1], device=transform.device, dtype=transform.dtype)
    difference = torch.baddbmm(identity.expand_as(transform), transform, transform.mT, beta=-1)
    norms: Tensor = torch.linalg.matrix_norm(difference)
    return norms.mean()


def penalised(loss: Loss, transform: Tensor | None, share: float) -> Loss:
    """A cross-entropy, and the penalty on the feature transform where there is one.

    Args:
        loss: Its total is the cross-entropy alone.
        transform: (B, K, K), or None.
        share: Weight of the penalty.
    """
    if transform is None:
        return loss
    penalty = share * orthogonality_penalty(transform.float())
    parts = {"cross_entropy": loss.total, "orthogonality": penalty}
    return Loss(loss.total + penalty, loss.logits, parts)


class _Alignment(nn.Module):
    """A transform (B, K, K) of K features, learned from them; the identity at first."""

    def __init__(
        self,
        features: int,
        channels: tuple[int, int, int],
        hidden: tuple[int, int],
        chunk: int,
    ) -> None:
        super().__init__()
        self.features = features
        self.shared = PointwiseMaximum((features, *channels), chunk, last_relu=True)
        self.head = _head(channels[-1], hidden, features * features, 0.0)
        for parameter in self.head[-1].parameters():
            nn.init.zeros_(parameter)

    def forward(self, points: Tensor) -> Tensor:
        flat: Tensor = self.head(self.shared(points))
        identity = torch.eye(self.features, device=flat.device, dtype=flat.dtype)
        return flat.view(-1, self.features, self.features) + identity


def _head(inputs: int, hidden: tuple[int, int], outputs: int, dropout: float) -> nn.Sequential:
    first, second = hidden
    return nn.Sequential(
        nn.Linear(inputs, first),
        nn.BatchNorm1d(first),
        nn.ReLU(),
        nn.Linear(first, second),
        nn.Dropout(dropout),
        nn.BatchNorm1d(second),
        nn.ReLU(),
        nn.Linear(second, outputs),
    )


class PointwiseStack(nn.Module):
    """Features of points (B, N, sizes[0]) to (B, N, sizes[-1]).

    A convolution of kernel 1 over (B, C, N), as PointNet's ports have it, is this linear layer;
    with the channels last no transposition is needed. Outside training the normalisation is folded
    into the weights.
    """

    def __init__(self, sizes: Sequence[int], *, last_relu: bool = True) -> None:
        """Make a layer between each two sizes; ``last_relu`` is whether the last has a ReLU."""
        super().__init__()
        last = len(sizes) - 2
        pairs = enumerate(pairwise(sizes))
        self.layers = nn.Sequential(*(_Layer(*pair, last_relu or i < last) for i, pair in pairs))

    def forward(self, points: Tensor) -> Tensor:
        """The features of every point."""
        if not self.training:
            return self.folded(points, self.fold())
        return self.layers(points)  # type: ignore[no-any-return]

    def fold(self) -> list[tuple[Tensor, Tensor, bool]]:
        """The weight and bias of each layer with its normalisation in them, and whether a ReLU."""
        return [layer.fold() for layer in self.layers if isinstance(layer, _Layer)]

    def maximum(self, points: Tensor) -> Tensor:
        """``self(points).max(1).values`` in training, without the last layer's activations."""
        *narrow, last = (layer for layer in self.layers if isinstance(layer, _Layer))
        for layer in narrow:
            points = layer(points)
        return last.maximum(points)

    def folded(self, x: Tensor, layers: list[tuple[Tensor, Tensor, bool]]) -> Tensor:
        """What :meth:`forward` gives outside training, by what :meth:`fold` gave."""
        for weight, bias, relu in layers:
            x = nn.functional.linear(x, weight, bias)
            x = torch.relu_(x) if relu else x
        return x


class _Layer(nn.Module):
    def __init__(self, inputs: int, outputs: int, relu: bool) -> None:
        super().__init__()
        self.linear = nn.Linear(inputs, outputs)
        self.norm = nn.BatchNorm2d(outputs)
        self.relu = relu

    def forward(self, x: Tensor) -> Tensor:
        # The points (B, N, C) seen as one picture with the channels last: normalised twice as fast.
        picture: Tensor = self.norm(self.linear(x).unsqueeze(0).permute(0, 3, 1, 2))
        x = picture.permute(0, 2, 3, 1).squeeze(0)
        return torch.relu(x) if self.relu else x

    def maximum(self, x: Tensor) -> Tensor:
        highest = normalised_maximum(x, self.linear, self.norm)
        return torch.relu(highest) if self.relu else highest

    def fold(self) -> tuple[Tensor, Tensor, bool]:
        mean, variance = self.norm.get_buffer("running_mean"), self.norm.get_buffer("running_var")
        scale = self.norm.weight * torch.rsqrt(variance + self.norm.eps)
        bias = (self.linear.bias - mean) * scale + self.norm.bias
        return self.linear.weight * scale[:, None], bias, self.relu


class PointwiseMaximum(nn.Module):
    """The maximum over N of a :class:`PointwiseStack`, (B, N, sizes[0]) to (B, sizes[-1]).

    In training the last layer's activations are not held either, see :func:`normalised_maximum`;
    outside training the points pass in chunks with a running maximum, so that the widest
    activation is (B, chunk, sizes[-1]) however many points there are. The result is the same.
    """

    def __init__(self, sizes: Sequence[int], chunk: int, *, last_relu: bool = True) -> None:
        """Make the stack; see :class:`PointwiseStack`."""
        super().__init__()
        self.stack = PointwiseStack(sizes, last_relu=last_relu)
        self.chunk = chunk

    def forward(self, points: Tensor) -> Tensor:
        """The largest features."""
        if self.training:
            return self.stack.maximum(points)
        layers = self.stack.fold()
        parts = (
            self.stack.folded(part, layers).amax(1) for part in torch.split(points, self.chunk, 1)
        )
        return reduce(torch.maximum, parts)
