"""Scripted motions: velocities given over time, poses by integration."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

import numpy as np
import pytest
from numpy.typing import NDArray

from graspe_data.arrays import Floats
from graspe_data.observation.labels.motion_series import (
    CommandSeries,
    InertialSeries,
    OdometrySeries,
)

START_NS = 1_700_000_000_000_000_000

Profile = Callable[[Floats], Floats] | float


def _stamps(seconds: float, rate: float) -> tuple[NDArray[np.int64], Floats]:
    times = np.arange(round(seconds * rate) + 1) / rate
    return START_NS + np.round(times * 1e9).astype(np.int64), times


def _values(profile: Profile, times: Floats) -> Floats:
    if callable(profile):
        return np.asarray(profile(times), np.float64)
    return np.full(times.shape, profile, np.float64)


class Drive(Protocol):
    def __call__(
        self, v: Profile, omega: Profile = 0.0, seconds: float = 10.0, rate: float = 20.0
    ) -> OdometrySeries: ...


class Command(Protocol):
    def __call__(
        self, v: Profile, omega: Profile = 0.0, seconds: float = 10.0, rate: float = 10.0
    ) -> CommandSeries: ...


class Inertial(Protocol):
    def __call__(
        self,
        forward: Profile = 0.0,
        pitch_rate: Profile = 0.0,
        seconds: float = 10.0,
        gravity: float = 9.81,
    ) -> InertialSeries: ...


@pytest.fixture
def start_ns() -> int:
    return START_NS


@pytest.fixture
def drive() -> Drive:
    def build(
        v: Profile, omega: Profile = 0.0, seconds: float = 10.0, rate: float = 20.0
    ) -> OdometrySeries:
        stamps, times = _stamps(seconds, rate)
        fine = np.linspace(0.0, times[-1], 20 * times.size)
        step = np.diff(fine, prepend=0.0)
        speed, turn = _values(v, fine), _values(omega, fine)
        yaw = np.cumsum(turn * step)
        x, y = np.cumsum(speed * np.cos(yaw) * step), np.cumsum(speed * np.sin(yaw) * step)
        x, y, yaw = (np.interp(times, fine, values) for values in (x, y, yaw))
        return OdometrySeries(stamps, x, y, yaw, _values(v, times), _values(omega, times))

    return build


@pytest.fixture
def command() -> Command:
    def build(
        v: Profile, omega: Profile = 0.0, seconds: float = 10.0, rate: float = 10.0
    ) -> CommandSeries:
        stamps, times = _stamps(seconds, rate)
        return CommandSeries(stamps, _values(v, times), _values(omega, times))

    return build


@pytest.fixture
def inertial() -> Inertial:
    def build(
        forward: Profile = 0.0,
        pitch_rate: Profile = 0.0,
        seconds: float = 10.0,
        gravity: float = 9.81,
    ) -> InertialSeries:
        stamps, times = _stamps(seconds, 100.0)
        still = np.zeros(times.size)
        gyro = np.stack([still, _values(pitch_rate, times), still], axis=1)
        accel = np.stack([_values(forward, times), still, still + gravity], axis=1)
        return InertialSeries(stamps, gyro, accel)

    return build
