"""What a planner is asked with, and what it answers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from graspe_data.sensor_data import Motion, Picture, PointCloud

Pose = tuple[float, float, float]
"""x, y in metres and yaw in rad, of base_link in a frame of the ground."""


@dataclass(frozen=True)
class Situation:
    """What a planner is asked with; it remembers nothing between calls.

    ``now_ns``: the moment of the question, ns, on the clock of the stamps below. ``pose``: x, y in
    metres and yaw in rad, base_link in the odometry frame. ``velocity``: m/s and rad/s, as driven
    now. ``goal``: x, y in metres, odometry frame. ``picture`` and ``cloud``: the latest, as the
    sensors gave them; None where there is none. ``motions``: odometry, oldest first, at least as
    long as the model's velocity history, with stamps. ``odometry_ns``: stamp of pose and velocity;
    None where they are those of the latest motion. Where they come from elsewhere, as from a
    localisation, it is needed: nothing else would tell that this has stopped.
    """

    now_ns: int
    pose: Pose
    velocity: tuple[float, float]
    goal: tuple[float, float]
    picture: Picture | None
    cloud: PointCloud | None
    motions: Sequence[Motion]
    odometry_ns: int | None = None

    @property
    def known_ns(self) -> int | None:
        """The stamp of pose and velocity; None where nothing tells."""
        if self.odometry_ns is not None:
            return self.odometry_ns
        stamps = [motion.stamp_ns for motion in self.motions if motion.stamp_ns is not None]
        return max(stamps, default=None)


@dataclass(frozen=True)
class Considered:
    """The candidates behind a command, for pictures and logs.

    ``velocities``: float64 (K, 2), m/s and rad/s. ``objective``: float64 (K,), the larger the
    better; for equation (9) it is Q. ``success``: float32 (K, T), 1 = success, or None where no
    model was asked. ``chosen``: row of the command, or None where it is none of them.
    """

    velocities: NDArray[np.float64]
    objective: NDArray[np.float64]
    success: NDArray[np.float32] | None
    chosen: int | None


@dataclass(frozen=True)
class Command:
    """A velocity to drive: m/s and rad/s in base_link.

    ``reason`` is empty for a planned command; else it says why this is a safe one. ``arrived``: the
    robot stands because it is at its goal.
    """

    linear_velocity: float
    yaw_rate: float
    reason: str = ""
    considered: Considered | None = None
    arrived: bool = False


class Planner(Protocol):
    """Answers a situation with a command; a planner in service never raises."""

    def command(self, situation: Situation) -> Command:
        """Choose the velocity of the next control period."""
        ...
