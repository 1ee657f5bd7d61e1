"""A map of the ground that a planner reads: what each cell costs, and which are barred."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from graspe_data.arrays import Floats, Map, Mask
from planners.situation import Pose, Situation


@dataclass(frozen=True)
class CostMap:
    """Maps (n, n) about the robot as it was at ``pose``; row 0 ahead of it, column 0 to its left.

    ``cost``: float32, 0..1, what a roll-out is charged for a cell. ``barred``: bool, cells that
    the robot's body must not run over, the inflation included. ``solid``: bool, the cells held for
    solid, before inflation. ``cell_m``: side of a cell, metres. ``pose``: x, y in metres and yaw in
    rad, odometry frame. ``stamp_ns``: of the cloud that the maps are made of.
    """

    cost: Map
    barred: Mask
    solid: Mask
    cell_m: float
    pose: Pose
    stamp_ns: int

    def solid_points(self) -> Floats:
        """Centres of the solid cells, float64 (N, 2), metres, in the map's frame."""
        middle = len(self.solid) / 2 - 0.5
        return np.asarray((middle - np.argwhere(self.solid)) * self.cell_m, np.float64)


class MapSource(Protocol):
    """Makes a map of what a robot sees."""

    def cost_map(self, situation: Situation) -> CostMap:
        """The map of the situation's cloud; the same for the same cloud.

        A source may remember earlier clouds; a stamp before the last one's begins anew.

        Raises:
            PlannerError: There is no cloud, or no map can be made of it.
        """
        ...


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
