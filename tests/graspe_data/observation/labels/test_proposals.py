"""All rules together say what they found and what they could not judge."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from graspe_data.arrays import Floats
from graspe_data.geometry import rotation_from_quaternion
from graspe_data.observation.labels.motion_series import MotionSeries
from graspe_data.observation.labels.proposals import ProposalSettings, propose

Build = Callable[..., Any]


def test_what_cannot_be_judged_is_said(drive: Build) -> None:
    proposals = propose(MotionSeries(drive(0.5)), ProposalSettings())
    assert proposals.events == ()
    assert set(proposals.unavailable) == {"stuck", "stumble"}
    assert "no commands" in proposals.unavailable["stuck"]


def test_a_rule_can_be_switched_off(drive: Build, command: Build, inertial: Build) -> None:
    series = MotionSeries(drive(0.0), command(0.5), inertial())
    assert [event.kind for event in propose(series, ProposalSettings()).events] == ["stuck"]
    off = propose(series, ProposalSettings(stuck=None))
    assert off.events == ()
    assert off.unavailable == {"stuck": "switched off by the configuration"}


def test_a_wall_and_pushing_on_are_two_events_in_order(drive: Build, command: Build) -> None:
    wall = drive(lambda times: np.where(times < 5, 1.0, 0.0))
    events = propose(MotionSeries(wall, command(1.0)), ProposalSettings()).events
    assert [event.kind for event in events] == ["collision", "stuck"]


def test_one_sample_is_enough_to_find_nothing(drive: Build, command: Build) -> None:
    single = drive(0.5, seconds=0.0)
    assert single.stamps_ns.size == 1
    tilted = replace(single, roll=np.zeros(1), pitch=np.zeros(1))
    for odometry in (single, tilted):
        assert propose(MotionSeries(odometry, command(0.5)), ProposalSettings()).events == ()


@pytest.mark.parametrize("seed", range(4))
def test_no_rule_depends_on_how_the_imu_is_mounted(
    drive: Build, command: Build, inertial: Build, seed: int
) -> None:
    def pulse(begin: float, size: float) -> Callable[[Floats], Floats]:
        return lambda times: np.where(np.abs(times - begin) < 0.1, size, 0.0)

    slowed = drive(lambda times: np.interp(times, [5, 5.3], [0.5, 0.0]))
    jolted = inertial(pulse(5.1, -30.0), pulse(8.0, 3.0))
    turning = jolted.gyro + np.array([0.0, 0.0, 2.0])
    upright = MotionSeries(slowed, command(0.5), replace(jolted, gyro=turning))
    mounting = rotation_from_quaternion(np.random.default_rng(seed).normal(size=4))
    assert upright.inertial is not None
    rotated = replace(
        upright.inertial, gyro=turning @ mounting.T, accel=upright.inertial.accel @ mounting.T
    )
    expected = propose(upright, ProposalSettings())
    assert {event.kind for event in expected.events} == {"stuck", "collision", "stumble"}
    assert propose(replace(upright, inertial=rotated), ProposalSettings()) == expected
