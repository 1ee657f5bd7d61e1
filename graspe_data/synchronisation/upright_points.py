"""Which points of a cloud lie on something upright: walls, trunks, poles, cars.

A lidar draws rings on the ground that move along with it. Point-to-point ICP pairs each with the
ring of the cloud before, and takes the robot for standing still: in a wood with 16 rings the
velocity came out 0.25 m/s too small. What is upright pulls sideways only where it should.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from graspe_data.arrays import Floats
from graspe_data.geometry import Transform

CELL_M = (1.0, 1.0, 2.0)
UPRIGHT_M = 0.25
"""Rise within a cell, from its lowest to its highest point, above which it is upright."""


def upright(points: Floats) -> NDArray[np.bool_]:
    """Which of the points (N, 3), metres, z up, share a cell with others well above or below."""
    if not len(points):
        return np.zeros(0, np.bool_)
    keys = cell_keys(np.floor(points / CELL_M).astype(np.int64))
    _, cell, count = np.unique(keys, return_inverse=True, return_counts=True)
    order = np.argsort(cell, kind="stable")
    starts = np.concatenate([[0], np.cumsum(count)[:-1]])
    height = points[order, 2]
    rise = np.maximum.reduceat(height, starts) - np.minimum.reduceat(height, starts)
    return np.asarray((rise > UPRIGHT_M)[cell])


def moved(points: Floats, by: Transform) -> Floats:
    """Points (N, 3) carried over number by number, so that no library's blocks round otherwise."""
    x, y, z = points.T
    parts = [
        row[0] * x + row[1] * y + row[2] * z + shift
        for row, shift in zip(by.rotation, by.translation, strict=True)
    ]
    return np.stack(parts, axis=1)


def cell_keys(cells: NDArray[np.int64]) -> NDArray[np.int64]:
    """One number a cell (..., 3), wrapped at 2^21 cells a side."""
    x, y, z = np.moveaxis(cells & 0x1FFFFF, -1, 0)
    keys: NDArray[np.int64] = (x << 42) | (y << 21) | z
    return keys
