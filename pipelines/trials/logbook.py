"""What was asked of a robot on its way, and what the world would have made of it."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from graspe_data.arrays import Floats, Mask
from graspe_data.robot import Robot
from graspe_data.simulation.motion.mechanics import MechanicsSettings
from graspe_data.simulation.truth.outlook import arc_success
from graspe_data.simulation.world.world import World
from planners.situation import Command, Considered

MOVES_ON = 0.05
"""m/s; a slower command does not ask the robot to move on."""


@dataclass(frozen=True)
class LogEntry:
    """One answer of a planner.

    ``step`` of the drive from which it was held; ``pose`` the true one then, x, y in metres and
    yaw in rad in the world; ``took_s`` seconds of wall clock that the answer took.
    """

    step: int
    pose: tuple[float, float, float]
    command: Command
    took_s: float

    @property
    def velocity(self) -> tuple[float, float]:
        """m/s and rad/s, as asked."""
        return self.command.linear_velocity, self.command.yaw_rate

    @property
    def moves_on(self) -> bool:
        """Whether it asks the robot to move on."""
        return self.command.linear_velocity >= MOVES_ON

    @property
    def predicted(self) -> float | None:
        """The least success promised of the arc; None where no model was asked of it."""
        considered = self.command.considered
        if considered is None or considered.success is None or considered.chosen is None:
            return None
        return float(considered.success[considered.chosen].min())

    @property
    def scored(self) -> Considered | None:
        """The candidates, where a model was asked of them."""
        considered = self.command.considered
        return considered if considered is not None and considered.success is not None else None


@dataclass
class Logbook:
    """The answers of one trial, in order, and the truth about their arcs."""

    world: World
    robot: Robot
    mechanics: MechanicsSettings
    entries: list[LogEntry] = field(default_factory=list)

    def free(self, entries: list[LogEntry]) -> Mask:
        """Whether the arcs that were asked for get through the world, bool (N,)."""
        poses = np.array([entry.pose for entry in entries]).reshape(-1, 3)
        velocities = np.array([entry.velocity for entry in entries]).reshape(-1, 2)
        return self._through(poses, velocities)

    def free_candidates(self, entry: LogEntry, candidates: Floats) -> Mask:
        """Whether arcs of velocities (K, 2) from there get through the world, bool (K,)."""
        return self._through(np.tile(np.array(entry.pose), (len(candidates), 1)), candidates)

    def _through(self, poses: Floats, velocities: Floats) -> Mask:
        success = arc_success(self.world, self.robot, poses, velocities, settings=self.mechanics)
        through: Mask = np.asarray(success.all(axis=1))
        return through
