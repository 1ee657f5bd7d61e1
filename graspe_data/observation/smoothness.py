"""Local smoothness of a cloud: GrASPE equation (3)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def smoothness(
    ordered_xyz: NDArray[np.float32], ring_starts: NDArray[np.int64], neighbours: int = 5
) -> NDArray[np.float32]:
    """Smoothness of every point against its neighbours on the same ring.

    Equation (3): c_l = |sum over k in M of (X_l - X_k)| / (|X_l| |M|). M holds up to
    ``neighbours`` points to each side in the ring's order; at the ends of a ring there are fewer,
    and |M| is the number really there. A point alone on its ring, or at the origin, gives 0.

    Args:
        ordered_xyz: Points (N, 3) in ring order, metres, in the lidar's own frame.
        ring_starts: (R + 1,), where each ring begins; last N. See ``ring_order``.
        neighbours: Points to each side.

    Returns:
        float32 (N,), 0 on a straight even line.
    """
    if len(ordered_xyz) == 0:
        return np.empty(0, np.float32)
    points = np.ascontiguousarray(ordered_xyz.T)
    around, size = _sums_around(points, ring_starts, neighbours)
    # sum (X_l - X_k) = (|M| + 1) X_l - (X_l + sum X_k)
    difference = (size + 1) * points
    difference -= around
    # c_l squared: |sum|^2 / (|X_l|^2 |M|^2)
    c = _squared_lengths(difference)
    norm = _squared_lengths(points)
    norm *= np.square(size, out=size)
    c /= np.maximum(norm, np.finfo(np.float32).tiny, out=norm)
    return np.sqrt(c, out=c)


def _squared_lengths(vectors: NDArray[np.float32]) -> NDArray[np.float32]:
    """Squared length (N,) of each column of (3, N)."""
    squares = np.square(vectors)
    total: NDArray[np.float32] = squares[0] + squares[1]
    total += squares[2]
    return total


def _sums_around(
    points: NDArray[np.float32], ring_starts: NDArray[np.int64], neighbours: int
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Sums (3, N) over each point and its neighbours, and the number (N,) of the neighbours."""
    total = points.shape[1]
    reach = np.arange(-neighbours, neighbours + 1)
    padded = np.zeros((3, total + 2 * neighbours), np.float32)
    padded[:, neighbours:-neighbours] = points
    sums = _window_sums(padded, len(reach))
    size = np.full(total, 2 * neighbours, np.float32)
    # Only windows that reach over the end of a ring have to be summed again.
    cut = np.zeros(total, np.bool_)
    cut[np.clip(np.add.outer(reach, ring_starts), 0, total - 1)] = True
    ends = np.flatnonzero(cut)
    ring = np.searchsorted(ring_starts, ends, side="right") - 1
    window = np.add.outer(reach, ends)
    same = (window >= ring_starts[ring]) & (window < ring_starts[ring + 1])
    sums[:, ends] = np.where(same, padded.take(window + neighbours, axis=1), 0).sum(axis=1)
    size[ends] = same.sum(axis=0) - 1
    return sums, size


def _window_sums(values: NDArray[np.float32], width: int) -> NDArray[np.float32]:
    """Sums over windows of the last axis, each power of two added once."""
    span, power = 1, values
    sums = np.zeros_like(values[:, : values.shape[1] - width + 1])
    offset = 0
    while True:
        if width & span:
            sums += power[:, offset : offset + sums.shape[1]]
            offset += span
        if 2 * span > width:
            return sums
        power = power[:, :-span] + power[:, span:]
        span *= 2
