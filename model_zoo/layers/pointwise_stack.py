"""Layers that treat every point alike: linear, batch normalisation, ReLU."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import torch
from torch import Tensor, nn

from model_zoo.layers.normalised_maximum import normalised_maximum


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
