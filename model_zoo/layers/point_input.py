"""Point clouds of a dataset as networks read them: near ones, a fixed number, bounded."""

from __future__ import annotations

import torch
from torch import Tensor


def choose_points(points: Tensor, point_count: Tensor, number: int) -> Tensor:
    """Choose the same number of points from every row, without chance.

    Where a row has more, they are evenly spaced among its points; where it has fewer, they are
    repeated in turn; where it has none, all are zero. Padding is never chosen.

    Args:
        points: float32 (B, N, 3), whatever it is past the count.
        point_count: int (B,), of real points.
        number: How many to choose.

    Returns:
        float32 (B, number, 3).
    """
    count = point_count.to(torch.int64).clamp(max=points.shape[1])[:, None]
    place = torch.arange(number, device=points.device)[None]
    spaced = place * count // number
    repeated = place % count.clamp(min=1)
    index = torch.where(count >= number, spaced, repeated)
    chosen = points.gather(1, index[:, :, None].expand(-1, -1, points.shape[2]))
    return chosen.where((count > 0)[:, :, None], 0.0)


def nearby_points(points: Tensor, point_count: Tensor, reach: float) -> tuple[Tensor, Tensor]:
    """Keep the points over the ground within ``reach`` of base_link, in their order.

    Args:
        points: float32 (B, N, 3), base_link, metres; whatever it is past the count.
        point_count: int (B,), of real points.
        reach: Metres, horizontally.

    Returns:
        Points (B, N, 3) that begin with those kept, and their number (B,).
    """
    rows, capacity, _ = points.shape
    place = torch.arange(capacity, device=points.device).expand(rows, -1)
    near = (points[:, :, :2].square().sum(2) < reach**2) & (place < point_count[:, None])
    # Points that are not kept all go to one place past the last.
    target = torch.where(near, near.cumsum(1) - 1, capacity)
    order = torch.zeros_like(target[:, :1]).repeat(1, capacity + 1).scatter(1, target, place)
    index = order[:, :capacity, None].expand(-1, -1, points.shape[2])
    return points.gather(1, index), near.sum(1)


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
