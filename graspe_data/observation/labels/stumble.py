"""Stumble: the body pitches, rolls or is thrown about."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from graspe_data.arrays import Floats
from graspe_data.manifest import Positive, Settings
from graspe_data.observation.labels.events import Event, join_intervals
from graspe_data.observation.labels.motion_series import (
    InertialSeries,
    OdometrySeries,
    gravity,
    moving_mean,
    shock,
)


class StumbleSettings(Settings):
    """When a motion of the body counts as a stumble."""

    tilt_rate: Positive = 1.0
    """rad/s, of roll and pitch together."""
    acceleration: Positive = 6.0
    """m/s^2, beyond gravity."""
    window_s: Positive = 0.1
    """Both are averaged over it with their signs, so that vibration and footfalls cancel."""
    join_s: Annotated[float, Field(ge=0)] = 0.5
    """Peaks no further apart belong to one stumble."""
    weak_gravity: Positive = 5.0
    """m/s^2; an IMU that feels less on average removes gravity, and its z is taken to be up."""


def stumble_events(
    odometry: OdometrySeries, inertial: InertialSeries | None, settings: StumbleSettings
) -> list[Event]:
    """Propose the stumbles, by the IMU where there is one, else by the odometry's roll and pitch.

    Without either there is nothing to judge by, and nothing is proposed.
    """
    if inertial is not None and inertial.stamps_ns.size:
        stamps, rates = inertial.stamps_ns, _across_gravity(inertial, settings.weak_gravity)
        thrown = shock(inertial, settings.window_s) > settings.acceleration
    else:
        stamps, rates = odometry.stamps_ns, _attitude_rates(odometry)
        thrown = np.zeros(stamps.size, np.bool_)
    half = settings.window_s / 2
    tilt_rate = np.linalg.norm(moving_mean(stamps, rates, half, half), axis=1)
    return _events(stamps, tilt_rate > settings.tilt_rate, thrown, round(settings.join_s * 1e9))


def _across_gravity(inertial: InertialSeries, weak: float) -> Floats:
    """Angular velocity (N, 3) less its part about the vertical, which is turning, not tilting.

    The vertical is gravity's, so the mounting does not matter; it is z where gravity is removed.
    """
    up = gravity(inertial)
    length = np.linalg.norm(up, axis=1, keepdims=True)
    strong = length > weak
    up = np.where(strong, up / np.where(strong, length, 1.0), (0.0, 0.0, 1.0))
    about = np.sum(inertial.gyro * up, axis=1, keepdims=True)
    across: Floats = inertial.gyro - about * up
    return across


def _attitude_rates(odometry: OdometrySeries) -> Floats:
    """Roll and pitch rates (N, 2) in rad/s, from the orientation."""
    if odometry.roll is None or odometry.pitch is None or odometry.stamps_ns.size == 1:
        return np.zeros((odometry.stamps_ns.size, 2))
    seconds = (odometry.stamps_ns - odometry.stamps_ns[0]) * 1e-9
    tilt = np.unwrap(np.stack([odometry.roll, odometry.pitch], axis=1), axis=0)
    rates: Floats = np.gradient(tilt, seconds, axis=0)
    return rates


def _events(
    stamps: NDArray[np.int64],
    tilting: NDArray[np.bool_],
    thrown: NDArray[np.bool_],
    join_ns: int,
) -> list[Event]:
    hits = stamps[tilting | thrown]
    starts, stops = join_intervals(hits, hits, join_ns)
    first, last = np.searchsorted(stamps, starts), np.searchsorted(stamps, stops)
    signs = ((tilting, "tilt rate"), (thrown, "acceleration"))
    return [
        Event(
            "stumble",
            int(stamps[i]),
            int(stamps[j]),
            " and ".join(name for mask, name in signs if mask[i : j + 1].any()),
        )
        for i, j in zip(first, last, strict=True)
    ]
