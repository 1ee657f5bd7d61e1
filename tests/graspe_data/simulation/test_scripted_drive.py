"""Scripted drives: commands followed with limited acceleration, along lines and arcs."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from graspe_data.simulation.scripted_drive import (
    ACCELERATION,
    GRAVITY,
    SHOCK,
    STEP_S,
    YAW_ACCELERATION,
    Drive,
    Effect,
    Leg,
    drive,
)

legs = st.builds(
    Leg,
    st.floats(0.05, 2.0),
    st.floats(-1.0, 1.0),
    st.floats(-1.5, 1.5),
    st.sampled_from(["free", "free", "stuck", "collision"]),
)


def at(driven: Drive, second: float) -> int:
    return round(second / STEP_S)


@settings(max_examples=50)
@given(st.lists(legs.filter(lambda leg: leg.effect == "free"), min_size=1, max_size=5))
def test_a_free_robot_accelerates_no_faster_than_it_can(script: list[Leg]) -> None:
    driven = drive(script)
    change = np.abs(np.diff(driven.velocity, axis=0)) / STEP_S
    assert (change <= np.array([ACCELERATION, YAW_ACCELERATION]) + 1e-9).all()
    commanded = np.abs(driven.command).max(axis=0)
    assert (np.abs(driven.velocity).max(axis=0) <= commanded + 1e-12).all()


@settings(max_examples=50)
@given(st.lists(legs, min_size=1, max_size=5))
def test_every_array_has_a_row_a_step_and_the_pose_is_where_the_velocity_leads(
    script: list[Leg],
) -> None:
    driven = drive(script, start=(3.0, -2.0, 0.5))
    steps = sum(round(leg.duration_s / STEP_S) for leg in script)
    assert [len(values) for values in vars(driven).values()] == [steps] * 5
    np.testing.assert_allclose(np.diff(driven.time_s), STEP_S, rtol=1e-9)
    moved = np.diff(driven.pose, axis=0) / STEP_S
    v, omega = driven.velocity[1:].T
    heading = driven.pose[1:, 2]
    expected = np.stack([v * np.cos(heading), v * np.sin(heading), omega], axis=1)
    np.testing.assert_allclose(moved, expected, atol=1e-9)
    np.testing.assert_allclose(driven.pose[0], (3.0, -2.0, 0.5), atol=1e-12)


def test_speed_rises_in_a_ramp_and_then_is_the_commanded_one() -> None:
    driven = drive([Leg(2.0, 0.6, 0.0)])
    ramp = np.minimum(ACCELERATION * driven.time_s, 0.6)
    np.testing.assert_allclose(driven.velocity[:, 0], ramp, atol=1e-12)
    covered = 0.6 * 2.0 - 0.6**2 / (2 * ACCELERATION)
    assert driven.pose[-1, 0] == pytest.approx(covered, abs=0.6 * STEP_S)
    np.testing.assert_array_equal(driven.pose[:, 1:], 0.0)


@pytest.mark.parametrize(("v", "omega"), [(0.6, 0.3), (0.5, -0.5), (-0.4, 0.25)])
def test_a_constant_command_drives_an_arc(v: float, omega: float) -> None:
    driven = drive([Leg(8.0, v, omega)], start=(1.0, 2.0, 0.7))
    x, y, yaw = driven.pose[at(driven, 2.0) :].T
    radius = v / omega
    centre = (x[0] - radius * np.sin(yaw[0]), y[0] + radius * np.cos(yaw[0]))
    np.testing.assert_allclose(np.hypot(x - centre[0], y - centre[1]), abs(radius), atol=0.005)
    np.testing.assert_allclose(np.diff(yaw), omega * STEP_S, rtol=1e-9)


def test_a_turn_on_the_spot_goes_nowhere() -> None:
    driven = drive([Leg(3.0, 0.0, 0.5)], start=(4.0, 5.0, 0.0))
    np.testing.assert_array_equal(driven.pose[:, :2], np.tile((4.0, 5.0), (300, 1)))
    turned = 0.5 * 3.0 - 0.5**2 / (2 * YAW_ACCELERATION)
    assert driven.pose[-1, 2] == pytest.approx(turned, abs=0.5 * STEP_S)


@pytest.mark.parametrize("effect", ["stuck", "collision"])
def test_a_held_robot_stands_while_it_is_told_to_drive_and_then_starts_anew(
    effect: Effect,
) -> None:
    driven = drive([Leg(2.0, 0.5, 0.1), Leg(2.0, 0.5, 0.1, effect), Leg(2.0, 0.5, 0.1)])
    held, free = at(driven, 2.0), at(driven, 4.0)
    np.testing.assert_array_equal(driven.velocity[held:free], 0.0)
    np.testing.assert_array_equal(driven.command, np.tile((0.5, 0.1), (600, 1)))
    still = driven.pose[held:free]
    np.testing.assert_array_equal(still, np.tile(still[0], (200, 1)))
    assert driven.velocity[free, 0] == pytest.approx(ACCELERATION * STEP_S)
    assert driven.velocity[-1].tolist() == [0.5, 0.1]


def test_a_collision_is_a_shock_of_five_steps() -> None:
    driven = drive([Leg(2.0, 0.6, 0.0), Leg(1.0, 0.6, 0.0, "collision")])
    forward = driven.acceleration[:, 0]
    assert np.flatnonzero(forward <= -SHOCK).tolist() == [200, 201, 202, 203, 204]
    np.testing.assert_array_equal(forward[205:], 0.0)


def test_who_gets_stuck_slowly_feels_no_shock() -> None:
    driven = drive([Leg(0.1, 0.1, 0.0), Leg(1.0, 0.6, 0.0, "stuck")])
    forward = driven.acceleration[:, 0]
    assert forward.min() == pytest.approx(-0.09 / STEP_S)
    assert (forward < -1).sum() == 1


def test_the_imu_feels_gravity_the_ramp_and_the_turn() -> None:
    driven = drive([Leg(4.0, 0.5, 0.4)])
    np.testing.assert_array_equal(driven.acceleration[:, 2], GRAVITY)
    np.testing.assert_allclose(driven.acceleration[1:50, 0], ACCELERATION, rtol=1e-9)
    np.testing.assert_allclose(driven.acceleration[60:, 0], 0.0, atol=1e-9)
    np.testing.assert_allclose(driven.acceleration[60:, 1], 0.5 * 0.4, rtol=1e-12)
