"""A scripted drive: commands, and what the robot makes of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

STEP_S = 0.01
ACCELERATION = 1.0
YAW_ACCELERATION = 3.2
GRAVITY = 9.81
SHOCK = 25.0

Effect = Literal["free", "stuck", "collision"]


@dataclass(frozen=True)
class Leg:
    """A command held for a while: seconds, m/s, rad/s.

    ``stuck`` keeps the robot where it is; ``collision`` stops it at once, with a shock.
    """

    duration_s: float
    linear_velocity: float
    yaw_rate: float
    effect: Effect = "free"


@dataclass(frozen=True)
class Drive:
    """The drive at steps of ``STEP_S``, arrays of one row a step.

    ``time_s`` (N,); ``pose`` (N, 3) x, y, yaw; ``velocity`` and ``command`` (N, 2) m/s, rad/s;
    ``acceleration`` (N, 3) m/s^2 as an IMU in base_link measures it, gravity included.
    """

    time_s: Floats
    pose: Floats
    velocity: Floats
    command: Floats
    acceleration: Floats


def drive(legs: Sequence[Leg], start: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> Drive:
    """Drive a script with limited acceleration, as a unicycle."""
    counts = [round(leg.duration_s / STEP_S) for leg in legs]
    command = np.repeat([(leg.linear_velocity, leg.yaw_rate) for leg in legs], counts, axis=0)
    held = np.repeat([leg.effect != "free" for leg in legs], counts)
    shocks = np.cumsum([0, *counts])[:-1][[leg.effect == "collision" for leg in legs]]
    velocity = np.zeros((len(command), 2))
    most = np.array([ACCELERATION, YAW_ACCELERATION]) * STEP_S
    for step in range(1, len(command)):
        change = np.clip(command[step] - velocity[step - 1], -most, most)
        velocity[step] = 0.0 if held[step] else velocity[step - 1] + change
    yaw = start[2] + np.cumsum(velocity[:, 1]) * STEP_S
    x = start[0] + np.cumsum(velocity[:, 0] * np.cos(yaw)) * STEP_S
    y = start[1] + np.cumsum(velocity[:, 0] * np.sin(yaw)) * STEP_S
    acceleration = np.zeros((len(command), 3))
    acceleration[1:, 0] = np.clip(np.diff(velocity[:, 0]) / STEP_S, -SHOCK, SHOCK)
    acceleration[:, 1] = velocity[:, 0] * velocity[:, 1]
    acceleration[:, 2] = GRAVITY
    for step in shocks.tolist():
        acceleration[step : step + 5, 0] = -SHOCK
    time_s = np.arange(len(command), dtype=np.float64) * STEP_S
    pose = np.stack([x, y, yaw], axis=1)
    return Drive(time_s, pose, velocity, command.astype(np.float64), acceleration)
