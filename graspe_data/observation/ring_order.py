"""The canonical order of a lidar cloud: ring by ring, each by azimuth."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from graspe_data.errors import ObservationError
from graspe_data.observation.ring_recovery import recover_rings

_AZIMUTH_BITS = 24
_RING_BITS = 16


@dataclass(frozen=True)
class RingOrder:
    """A permutation of a cloud that does not depend on the order of its points.

    ``order``: int64 (N,), indices into the cloud, sorted by ring, azimuth from behind the sensor
    counter-clockwise, range, then the bits of the values; points that tie in all are equal.
    ``ring_starts``: int64 (R + 1,), where each ring that has points begins in ``order``; last N.
    """

    order: NDArray[np.int64]
    ring_starts: NDArray[np.int64]


def ring_order(
    xyz: NDArray[np.float32],
    ring: NDArray[np.integer] | None,
    rings: int | None = None,
    intensity: NDArray[np.float32] | None = None,
) -> RingOrder:
    """Order a cloud ring by ring.

    Args:
        xyz: Points (N, 3), metres, in the lidar's own frame, all finite.
        ring: Ring of each point (N,), or None to recover it from the geometry.
        rings: How many rings the lidar has, a help to recover them; None if not known.
        intensity: (N,), takes part in the order of points that are otherwise equal.

    Raises:
        ObservationError: The ring field has more values than any lidar has rings.
    """
    if len(xyz) == 0:
        return RingOrder(np.empty(0, np.int64), np.zeros(1, np.int64))
    x, y, _ = xyz.T
    # One key a point: its ring, then its azimuth; one sort orders both.
    numbers = recover_rings(xyz, rings) if ring is None else _compact(ring)
    key = numbers.astype(np.uint64) << np.uint64(_AZIMUTH_BITS) | _azimuth(x, y)
    order, sorted_key = _sort(key)
    # Equal keys are ordered by what else tells points apart, never by their place in the message.
    ties = sorted_key[1:] == sorted_key[:-1]
    if ties.any():
        _resolve(order, sorted_key, ties, xyz, intensity)
    # A ring begins where the number changes.
    sorted_numbers = sorted_key >> np.uint64(_AZIMUTH_BITS)
    starts = np.flatnonzero(sorted_numbers[1:] != sorted_numbers[:-1]) + 1
    return RingOrder(order, np.concatenate(([0], starts, [len(xyz)])))


def _compact(ring: NDArray[np.integer]) -> NDArray[np.integer]:
    """Ring numbers that fit in their bits, in the same order."""
    if ring.min() >= 0 and ring.max() < 1 << _RING_BITS:
        return ring
    values, compact = np.unique(ring, return_inverse=True)
    if len(values) > 1 << _RING_BITS:
        raise ObservationError(
            f"ring: {len(values)} different values in {len(ring)} points, expected at most "
            f"{1 << _RING_BITS}: this field is no ring number; decode the cloud without it."
        )
    return np.asarray(compact, np.int64)


def _azimuth(x: NDArray[np.float32], y: NDArray[np.float32]) -> NDArray[np.uint32]:
    """Azimuth as an integer that grows from -pi to pi, by the diamond angle.

    It needs only sums and a quotient, which every processor rounds alike.
    """
    norm = np.maximum(np.abs(x) + np.abs(y), np.finfo(np.float32).tiny)
    quarters = 2 + np.copysign(1 - x / norm, y)
    # Of a signed integer, which processors convert to in one step.
    steps: NDArray[np.int32] = (quarters * np.float32(1 << (_AZIMUTH_BITS - 2))).astype(np.int32)
    np.minimum(steps, np.int32((1 << _AZIMUTH_BITS) - 1), out=steps)
    return steps.view(np.uint32)


def _sort(key: NDArray[np.uint64]) -> tuple[NDArray[np.int64], NDArray[np.uint64]]:
    """Stable order of keys, and the keys in it.

    NumPy sorts words faster than it sorts what words stand for, so each key carries the place it
    came from in its lowest bits: equal keys then differ, and stay in the order they came in.
    """
    place_bits = max(1, (len(key) - 1).bit_length())
    if place_bits + _AZIMUTH_BITS + _RING_BITS > np.uint64(0).nbytes * 8:
        order = np.argsort(key, kind="stable")
        return order, key.take(order)
    words = key << np.uint64(place_bits)
    words |= np.arange(len(key), dtype=np.uint64)
    words.sort()
    place = words & np.uint64((1 << place_bits) - 1)
    words >>= np.uint64(place_bits)
    return place.view(np.int64), words


def _resolve(
    order: NDArray[np.int64],
    key: NDArray[np.uint64],
    ties: NDArray[np.bool_],
    xyz: NDArray[np.float32],
    intensity: NDArray[np.float32] | None,
) -> None:
    """Order the points of equal ring and azimuth in place."""
    tied = np.zeros(len(order), np.bool_)
    tied[1:] |= ties
    tied[:-1] |= ties
    rows = order[tied]
    values = xyz[rows] if intensity is None else np.column_stack((xyz[rows], intensity[rows]))
    squared_range = (xyz[rows] ** 2).sum(axis=1)
    bits = np.ascontiguousarray(values, np.float32).view(np.int32)
    order[tied] = rows[np.lexsort((*bits.T[::-1], squared_range, key[tied]))]
