"""A map of the ground that a planner reads: what each cell costs, and which are barred."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from graspe_data.arrays import Floats, Map, Mask
from planners.situation import Situation


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
    pose: tuple[float, float, float]
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
