"""Series refuse what no rule could judge."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from graspe_data.errors import ObservationError
from graspe_data.observation.labels.motion_series import CommandSeries

Build = Callable[..., Any]


def test_unequal_lengths_are_refused_by_name(drive: Build) -> None:
    with pytest.raises(ObservationError, match=r"Odometry: v: expected shape \(201,\), found \(5,"):
        replace(drive(0.5), v=np.zeros(5))


def test_a_value_that_is_no_number_is_refused_with_its_sample(drive: Build) -> None:
    series = drive(0.5)
    yaw = series.yaw.copy()
    yaw[7] = np.nan
    with pytest.raises(ObservationError, match="yaw: sample 7 at 1700000000350000000 ns"):
        replace(series, yaw=yaw)


def test_stamps_that_do_not_increase_are_refused(drive: Build) -> None:
    series = drive(0.5)
    stamps = series.stamps_ns.copy()
    stamps[3] = stamps[2]
    with pytest.raises(ObservationError, match=r"sample 3 at .* does not come after"):
        replace(series, stamps_ns=stamps)


def test_odometry_without_samples_is_refused(drive: Build) -> None:
    with pytest.raises(ObservationError, match="no samples"):
        replace(drive(0.5), stamps_ns=np.zeros(0, np.int64))


def test_a_command_is_held_and_ages() -> None:
    series = CommandSeries(np.array([10, 20]) * 10**9, np.array([1.0, 2.0]), np.array([0.1, 0.2]))
    v, omega, age = series.held(np.array([5, 10, 19, 25]) * 10**9)
    assert v.tolist() == [0, 1, 1, 2]
    assert omega.tolist() == [0, 0.1, 0.1, 0.2]
    np.testing.assert_allclose(age, [np.inf, 0, 9, 5])


def test_no_commands_hold_nothing() -> None:
    none = CommandSeries(np.zeros(0, np.int64), np.zeros(0), np.zeros(0))
    assert none.held(np.array([5, 6]))[2].tolist() == [np.inf, np.inf]


def test_odometry_is_interpolated(drive: Build, start_ns: int) -> None:
    asked = np.array([[start_ns + 1_025_000_000]])
    x, y, yaw, v, omega = drive(0.5).at(asked)
    assert x == pytest.approx(0.5125, abs=1e-3)
    assert (y, yaw, v, omega) == (0, 0, 0.5, 0)
    assert x.shape == (1, 1)
