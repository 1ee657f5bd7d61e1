"""Odometry: what the robot thinks of its own motion, and how that drifts."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from pydantic import Field

from graspe_data.arrays import Floats
from graspe_data.manifest import Settings
from graspe_data.simulation.motion.drive import STEP_S

Spread = Annotated[float, Field(ge=0, le=1)]


class OdometrySettings(Settings):
    """Errors of the odometry."""

    scale: Spread = 0.01
    """Standard deviation of the speed's and the yaw rate's scale, fixed for a drive."""
    slip_seen: Spread = 0.5
    """Share of the slip that the odometry notices."""
    speed_noise: Spread = 0.005
    """m/s, standard deviation of each sample."""
    yaw_rate_noise: Spread = 0.004
    """rad/s, likewise."""
    yaw_walk: Spread = 0.003
    """rad per square root of a second, of the heading."""


@dataclass(frozen=True)
class OdometryErrors:
    """The errors of one drive of at most N steps.

    ``scale`` float64 (2,), factors of v and omega. ``noise`` (N, 2), m/s and rad/s. ``walk`` (N,),
    rad that the heading drifts at each step.
    """

    scale: Floats
    noise: Floats
    walk: Floats


def draw_odometry_errors(
    settings: OdometrySettings, steps: int, generator: np.random.Generator
) -> OdometryErrors:
    """Draw the errors of a drive of so many steps of ``STEP_S``."""
    scale = 1 + generator.normal(0.0, settings.scale, 2)
    noise = generator.normal(0.0, (settings.speed_noise, settings.yaw_rate_noise), (steps, 2))
    walk = generator.normal(0.0, settings.yaw_walk * np.sqrt(STEP_S), steps)
    return OdometryErrors(scale, noise, walk)


def dead_reckoning(
    errors: OdometryErrors, velocity: Floats, slip: Floats, slip_seen: float
) -> tuple[Floats, Floats]:
    """Velocities as the odometry reports them, and the poses that it makes of them.

    What it reports of a step does not depend on the steps after it.

    Args:
        errors: Of N steps or more.
        velocity: (N, 2) true v and omega, m/s and rad/s, at steps of ``STEP_S``.
        slip: (N,), share of the legs' speed that was lost.
        slip_seen: Share of the slip that the odometry notices.

    Returns:
        v and omega (N, 2), and x, y, yaw (N, 3) from 0 at the first step; yaw is not wrapped.
    """
    count = len(velocity)
    unseen = (1 - slip_seen * slip) / (1 - slip)
    reported = velocity * errors.scale * unseen[:, None]
    turned = np.cumsum(reported[1:, 1] * STEP_S + errors.walk[1:count])
    yaw = np.concatenate([[0.0], turned])
    middle = (yaw[1:] + yaw[:-1]) / 2
    way = reported[1:, :1] * STEP_S * np.stack([np.cos(middle), np.sin(middle)], axis=1)
    place = np.concatenate([np.zeros((1, 2)), np.cumsum(way, axis=0)])
    return reported + errors.noise[:count], np.column_stack([place, yaw])
