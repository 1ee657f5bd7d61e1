"""PointNet (Qi et al., CVPR 2017), in the form of fxia22's pointnet.pytorch."""

from __future__ import annotations

from typing import NamedTuple

import torch
from torch import Tensor, nn

from graspe_data.manifest import Settings
from model_zoo.bounds import Points, Share, Units
from model_zoo.layers.pointwise_maximum import PointwiseMaximum
from model_zoo.layers.pointwise_stack import PointwiseStack


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
