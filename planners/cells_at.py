"""The cells that points lie in, and what a map holds there."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from graspe_data.arrays import Floats


def cells_at(points: Floats, cells: int, cell_m: float) -> tuple[NDArray[np.int64], ...]:
    """Row and column, each int64 (...), of points (..., 2); row 0 ahead, column 0 left.

    Args:
        points: x, y in metres in the map's frame, whose origin is the corner in its middle.
        cells: Along a side of the map.
        cell_m: Side of a cell, metres.
    """
    place = np.floor(cells / 2 - points / cell_m).astype(np.int64)
    return place[..., 0], place[..., 1]


def values_at(values: NDArray[Any], points: Floats, cell_m: float) -> NDArray[Any]:
    """What a map (n, n) holds at points (..., 2), of the map's dtype; 0 off the map."""
    side = len(values)
    row, column = cells_at(points, side, cell_m)
    inside = (row >= 0) & (row < side) & (column >= 0) & (column < side)
    found = values[np.where(inside, row, 0), np.where(inside, column, 0)]
    return np.where(inside, found, values.dtype.type(0))
