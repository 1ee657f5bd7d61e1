"""The obstacles near a moving robot."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from graspe_data.arrays import Floats
from graspe_data.robot import Footprint
from graspe_data.simulation.motion.footprint import clearance
from graspe_data.simulation.world.obstacles import Obstacles

AHEAD = 1.0


class Surroundings:
    """Keeps the obstacles near a robot at hand while it moves."""

    def __init__(self, obstacles: Obstacles, footprint: Footprint) -> None:
        """Take all obstacles; those that act on nothing are left out."""
        self._all = obstacles.having("slows", "stumbles", "entangles", "stops")
        self._footprint = footprint
        self._radius = float(np.hypot(footprint.length, footprint.width)) / 2
        self._centre = np.full(2, np.inf)
        self.near = self._all
        self.index: NDArray[np.intp] = np.arange(len(self._all.radius))

    def left(self, pose: Floats) -> bool:
        """Whether a pose (3,) is too far from where the robot looked for what is near."""
        return not np.hypot(*(pose[:2] - self._centre)) <= AHEAD

    def look(self, pose: Floats) -> Floats:
        """Signed distances (N,) at a pose (3,), after finding out which N are near there."""
        if self.left(pose):
            self._look_around(pose[:2])
        gaps: Floats = self.gaps(pose[None])[0]
        return gaps

    def gaps(self, poses: Floats) -> Floats:
        """Signed distances (P, N) at poses (P, 3) about that place from the ``near`` ones."""
        return clearance(self._footprint, poses, self.near)

    def free_way(self, gaps: Floats) -> float:
        """How far any point of the robot can go before it can touch anything, metres."""
        return min(AHEAD, float(gaps.min(initial=AHEAD)))

    def way(self, v: float, omega: float, seconds: float) -> float:
        """An upper bound of how far any point of the robot goes, metres."""
        return (abs(v) + abs(omega) * self._radius) * seconds

    def _look_around(self, centre: Floats) -> None:
        """Keep what can be within ``AHEAD`` of the footprint until it has moved by ``AHEAD``."""
        along = self._all.end - self._all.start
        offset = centre - self._all.start
        square = np.maximum(np.sum(along**2, axis=1), 1e-12)
        share = np.clip(np.sum(offset * along, axis=1) / square, 0.0, 1.0)
        distance = np.linalg.norm(offset - share[:, None] * along, axis=1) - self._all.radius
        self.index = np.flatnonzero(distance <= self._radius + 2.1 * AHEAD)
        self.near = self._all.at(self.index)
        self._centre = np.array(centre)
