"""The largest value over all points of features that are never all held at once."""

from __future__ import annotations

from collections.abc import Sequence
from functools import reduce

import torch
from torch import Tensor, nn

from model_zoo.layers.pointwise_stack import PointwiseStack


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
