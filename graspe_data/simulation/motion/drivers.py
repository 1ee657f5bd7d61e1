"""Who drives: anything that answers the robot's state with a command."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

COMMAND_STEPS = 10
"""Steps of the drive between two commands: 10 Hz."""


@dataclass(frozen=True)
class RobotState:
    """The robot when it asks for a command.

    ``time_s``; ``pose`` x, y, yaw in the world, metres, rad; ``velocity`` v, omega, m/s, rad/s.
    ``stopped``: pressed against something solid. ``speed_share``: of the commanded speed that
    vegetation leaves. ``entangled``: inside something that entangles.
    """

    time_s: float
    pose: tuple[float, float, float]
    velocity: tuple[float, float]
    stopped: bool = False
    speed_share: float = 1.0
    entangled: bool = False


class Driver(Protocol):
    """Answers every 0.1 s."""

    def command(self, state: RobotState) -> tuple[float, float]:
        """Linear velocity in m/s and yaw rate in rad/s to hold until asked again."""
        ...


@dataclass(frozen=True)
class Leg:
    """A command held for a while: seconds, m/s, rad/s."""

    duration_s: float
    linear_velocity: float
    yaw_rate: float


class ScriptedDriver:
    """Drives legs one after the other, whatever happens, and then stands."""

    def __init__(self, legs: Sequence[Leg]) -> None:
        """Take the legs in order."""
        self._legs = tuple(legs)
        self._ends = np.cumsum([leg.duration_s for leg in legs])

    def command(self, state: RobotState) -> tuple[float, float]:
        """The command of the leg that runs."""
        index = int(np.searchsorted(self._ends, state.time_s + 1e-9, side="right"))
        if index >= len(self._legs):
            return 0.0, 0.0
        leg = self._legs[index]
        return leg.linear_velocity, leg.yaw_rate
