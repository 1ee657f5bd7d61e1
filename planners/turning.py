"""Rotations on the spot, for when no other candidate is left."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from pydantic import Field

from graspe_data.arrays import Floats
from graspe_data.manifest import Settings
from graspe_data.robot import Limits

_UNDER_WAY = 0.1
"""rad/s from which a rotation counts as begun: it is kept up, or it would go to and fro."""


class TurnSettings(Settings):
    """How a robot turns that cannot go on."""

    rate: Annotated[float, Field(gt=0)] = 0.4
    """rad/s, at most the robot's own limit."""
    facing: Annotated[float, Field(ge=0)] = 0.5
    """rad: with the goal nearer ahead than this, the side with fewer obstacles is taken."""
    reach: Annotated[float, Field(gt=0)] = 3.0
    """Metres within which obstacles count for that."""


def turns_on_the_spot(
    limits: Limits, yaw_rate: float, error: float, points: Floats, settings: TurnSettings
) -> Floats:
    """Rotations (R, 2) on the spot, the preferred one first: m/s, which is 0, and rad/s.

    A rotation under way goes on; else the robot turns to the goal, and where it faces that
    already, to the side with fewer obstacles.

    Args:
        limits: A robot that cannot turn one way, or stand, is not asked to.
        yaw_rate: Now, rad/s.
        error: Angle to the goal, rad, positive to the left.
        points: Obstacles (N, 2), metres, base_link.
        settings: Rate and angles.
    """
    side = error
    if abs(yaw_rate) > _UNDER_WAY:
        side = yaw_rate
    elif abs(error) < settings.facing:
        side = _freer_side(points, settings.reach) or error
    first = 1.0 if side >= 0 else -1.0
    rates = np.clip([first * settings.rate, -first * settings.rate], *limits.yaw_rate)
    stands = limits.linear_velocity[0] <= 0 <= limits.linear_velocity[1]
    useful = (rates * (first, -first) > 0) & stands
    return np.stack((np.zeros(2), rates), axis=1)[useful]


def _freer_side(points: Floats, reach: float) -> float:
    """Positive where the left is freer; near obstacles weigh more."""
    distance = np.hypot(points[:, 0], points[:, 1])
    near = (distance < reach) & (distance > 0)
    return float(-np.sum(points[near, 1] / distance[near] ** 2))
