"""Rays of a sensor that moves while it turns."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from graspe_data.geometry import Transform

Floats32 = NDArray[np.float32]


def moving_rays(
    rays: Floats32, knot: NDArray[np.float64], poses: Sequence[Transform]
) -> tuple[Floats32, Floats32]:
    """Carry rays into the world, each from where the sensor is when it is sent.

    Between poses both translation and rotation matrix are blended linearly; over an angle of
    delta rad this shortens a direction by no more than delta^2 / 8.

    Args:
        rays: (N, K, 3), in the sensor's frame, in order of time.
        knot: (N,), rising, when each is sent: 2.5 is halfway between the poses 2 and 3.
        poses: The sensor in the world at the knots 0, 1, ...

    Returns:
        Origins and directions, each (N K, 3).
    """
    pairs = list(pairwise(poses)) or [(poses[0], poses[0])]
    interval = np.clip(knot.astype(np.intp), 0, len(pairs) - 1)
    bounds = np.searchsorted(interval, np.arange(len(pairs) + 1))
    origins, directions = np.empty_like(rays), np.empty_like(rays)
    for index, (first, last) in enumerate(pairs):
        rows = slice(bounds[index], bounds[index + 1])
        share = (knot[rows, None, None] - index).astype(np.float32)
        moved = (last.translation - first.translation).astype(np.float32)
        origins[rows] = first.translation + share * moved
        directions[rows] = _turned(rays[rows], first.rotation)
        directions[rows] += share * _turned(rays[rows], last.rotation - first.rotation)
    return origins.reshape(-1, 3), directions.reshape(-1, 3)


def _turned(rays: Floats32, rotation: NDArray[np.float64]) -> Floats32:
    # einsum sums in one order, whatever the number of threads.
    turned: Floats32 = np.einsum("nkj,ij->nki", rays, rotation.astype(np.float32))
    return turned
