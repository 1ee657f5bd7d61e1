"""Collision: a stop too hard and too short for a brake, uncommanded or felt as a hit."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from graspe_data.arrays import Floats, Mask
from graspe_data.manifest import Positive, Settings
from graspe_data.observation.labels.events import Event, Indices, true_runs
from graspe_data.observation.labels.motion_series import (
    CommandSeries,
    InertialSeries,
    OdometrySeries,
    moving_mean,
    shock,
)


class CollisionSettings(Settings):
    """When a loss of speed counts as a collision."""

    deceleration: Positive = 3.0
    """m/s^2, of the odometry's speed over ``window_s``."""
    window_s: Positive = 0.1
    """Sampled more slowly, the odometry is compared from sample to sample."""
    minimum_speed: Positive = 0.2
    """m/s, before: the mean velocity over ``sustained_s``, so that noise about rest has none."""
    sustained_s: Positive = 0.2
    remaining_fraction: Annotated[float, Field(gt=0, lt=1)] = 0.3
    """Of the speed before; after a collision less than this is left."""
    maximum_s: Positive = 0.6
    """A deceleration that lasts longer is a hard brake."""
    settle_s: Annotated[float, Field(ge=0)] = 0.2
    """After the deceleration, time for a rebound to end."""
    shock: Positive = 10.0
    """m/s^2, of the IMU; with such a peak ``shocked_deceleration`` is evidence enough, and a loss
    of speed that is as hard as ``deceleration`` is no brake, which friction limits to about g."""
    shocked_deceleration: Positive = 1.0
    """m/s^2."""
    command_timeout_s: Positive = 0.5
    """An older command counts as a stop: controllers stop when commands cease."""
    command_memory_s: Positive = 1.5
    """A robot that moves without any command for so long is driven by other means."""
    maximum_gap_s: Positive = 0.5
    """Nothing is concluded across a longer gap in the odometry."""


def collision_events(
    odometry: OdometrySeries,
    command: CommandSeries | None,
    inertial: InertialSeries | None,
    settings: CollisionSettings,
) -> list[Event]:
    """Propose the collisions.

    Args:
        odometry: Gives the speed.
        command: Commands, where there are any: a commanded stop is no collision, unless it is both
            hard and felt as a shock.
        inertial: IMU samples, where there are any: their peaks support weaker decelerations.
        settings: Thresholds.
    """
    stamps, speed = odometry.stamps_ns, np.abs(odometry.v)
    later, deceleration = _deceleration(stamps, speed, settings)
    hard = deceleration > settings.deceleration
    shocked = _shocked(stamps, stamps[later], inertial, settings.shock)
    slowing = hard | (shocked & (deceleration > settings.shocked_deceleration))
    first, last = true_runs(slowing, stamps, round(settings.maximum_gap_s * 1e9))
    end = later[last]
    after = np.minimum(speed[end], speed[_index_after(stamps, stamps[end], settings.settle_s)])
    before = np.abs(moving_mean(stamps, odometry.v, settings.sustained_s, 0.0))[first]
    real = (before > settings.minimum_speed) & (after < settings.remaining_fraction * before)
    real &= stamps[end] - stamps[first] <= settings.maximum_s * 1e9
    real &= stamps[first] - stamps[0] >= settings.sustained_s * 1e9
    if command is not None:
        noticed = stamps[later[first]]
        commanded = _commanded_stop(noticed, odometry.v[first], command, settings)
        real &= ~commanded | _within(hard & shocked, first, last)
    return [
        Event("collision", int(start), int(stop), f"{fast:.2f} to {slow:.2f} m/s")
        for start, stop, fast, slow in zip(
            stamps[first[real]], stamps[end[real]], before[real], after[real], strict=True
        )
    ]


def _index_after(stamps: NDArray[np.int64], moments: NDArray[np.int64], seconds: float) -> Indices:
    """The first sample at least so much later; the last one where there is none."""
    index = np.searchsorted(stamps, moments + round(seconds * 1e9))
    return np.minimum(index, stamps.size - 1)


def _deceleration(
    stamps: NDArray[np.int64], speed: Floats, settings: CollisionSettings
) -> tuple[Indices, Floats]:
    """For each sample, the one a window later and the mean deceleration until then."""
    later = _index_after(stamps, stamps, settings.window_s)
    elapsed = (stamps[later] - stamps) * 1e-9
    usable = (elapsed > 0) & (elapsed <= settings.maximum_gap_s)
    return later, np.where(usable, (speed - speed[later]) / np.where(usable, elapsed, 1.0), 0.0)


def _shocked(
    start: NDArray[np.int64],
    stop: NDArray[np.int64],
    inertial: InertialSeries | None,
    threshold: float,
) -> Mask:
    """Whether the IMU felt a peak from start to stop; without one it felt none."""
    if inertial is None:
        return np.zeros(start.shape, np.bool_)
    peaks = inertial.stamps_ns[shock(inertial) > threshold]
    mask: Mask = np.searchsorted(peaks, stop, side="right") > np.searchsorted(peaks, start)
    return mask


def _within(mask: Mask, first: Indices, last: Indices) -> Mask:
    """Whether any sample from first to last, both included, is true."""
    count = np.concatenate([[0], np.cumsum(mask)])
    some: Mask = count[last + 1] > count[first]
    return some


def _commanded_stop(
    stamps: NDArray[np.int64], v: Floats, command: CommandSeries, settings: CollisionSettings
) -> Mask:
    """Whether the command at that time asks for less than the remaining fraction of v."""
    commanded, _, age = command.held(stamps)
    forward = np.where(age <= settings.command_timeout_s, commanded * np.sign(v), 0.0)
    braking: Mask = forward < settings.remaining_fraction * np.abs(v)
    return braking & (age <= settings.command_memory_s)
