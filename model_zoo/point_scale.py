"""Coordinates of points as networks take them in."""

from __future__ import annotations

import torch
from torch import Tensor


def bounded(points: Tensor, half_range: float) -> Tensor:
    """Points (..., 3), p / (half_range + |p|): directions stay, and lengths lie within 0 and 1.

    Divided by a constant, trees a hundred metres away spread the coordinates so far that batch
    normalisation leaves a rock two metres ahead nothing to be told by. So near lengths are told
    apart in units of ``half_range``, at which a length is 0.5, and far ones hardly.

    Args:
        points: Metres.
        half_range: Metres.
    """
    length: Tensor = torch.linalg.vector_norm(points, dim=-1, keepdim=True)
    return points / (half_range + length)
