"""Stuck: commanded to move, and not moving."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from pydantic import Field

from graspe_data.arrays import Floats
from graspe_data.manifest import Positive, Settings
from graspe_data.observation.labels.events import Event, true_runs
from graspe_data.observation.labels.motion_series import CommandSeries, OdometrySeries, moving_mean


class StuckSettings(Settings):
    """When a robot counts as stuck."""

    commanded_speed: Positive = 0.2
    """m/s; a slower command is no demand to drive."""
    commanded_yaw_rate: Positive = 0.3
    """rad/s; looked at where no speed is commanded."""
    moving_fraction: Annotated[float, Field(gt=0, le=1)] = 0.2
    """Of the commanded speed or yaw rate; the robot is stuck below it."""
    window_s: Annotated[float, Field(ge=0)] = 0.1
    """Both are averaged over it with their signs, so that noise frees no robot that creeps."""
    minimum_s: Positive = 1.0
    """A shorter hold is a robot that is starting."""
    command_timeout_s: Positive = 0.5
    """An older command no longer holds."""
    maximum_gap_s: Positive = 0.5
    """Nothing is concluded across a longer gap in the odometry."""


def stuck_events(
    odometry: OdometrySeries, command: CommandSeries, settings: StuckSettings
) -> list[Event]:
    """Propose the intervals in which the robot does not follow its command to move.

    A commanded speed is held against the speed alone: a robot that turns on the spot at a wall
    that it is told to drive through is stuck. Wheel odometry does not see wheels that slip.
    """
    v, omega, age = command.held(odometry.stamps_ns)
    v, omega = np.abs(v), np.abs(omega)
    told_to_drive = v >= settings.commanded_speed
    told_to_turn = ~told_to_drive & (omega >= settings.commanded_yaw_rate)
    speed, turning = _means(odometry, settings.window_s)
    stands = np.abs(speed) < settings.moving_fraction * v
    does_not_turn = np.abs(turning) < settings.moving_fraction * omega
    held = age <= settings.command_timeout_s
    mask = held & ((told_to_drive & stands) | (told_to_turn & does_not_turn))
    first, last = true_runs(mask, odometry.stamps_ns, round(settings.maximum_gap_s * 1e9))
    starts, stops = odometry.stamps_ns[first], odometry.stamps_ns[last]
    return [
        Event("stuck", int(start), int(stop), f"commanded {v[i]:.2f} m/s, {omega[i]:.2f} rad/s")
        for start, stop, i in zip(starts, stops, first, strict=True)
        if stop - start >= settings.minimum_s * 1e9
    ]


def _means(odometry: OdometrySeries, window_s: float) -> tuple[Floats, Floats]:
    half = window_s / 2
    velocity = np.stack([odometry.v, odometry.omega], axis=1)
    speed, turning = moving_mean(odometry.stamps_ns, velocity, half, half).T
    return speed, turning
