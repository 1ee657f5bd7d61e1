from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from graspe_data.geometry import rotation_from_quaternion
from graspe_data.recordings.decoding import decode_motion
from graspe_data.synchronisation.differentiate import body_velocities
from tests.graspe_data.synchronisation.made_recording import CURVES, Drive, times

Floats = NDArray[np.float64]


def of_quaternions(
    stamps_ns: NDArray[np.int64], position: Floats, quaternion: Floats
) -> tuple[Floats, Floats]:
    """Velocities by positions (N, 3) and quaternions (N, 4); one without length is no rotation."""
    with np.errstate(invalid="ignore"):
        unit = quaternion / np.linalg.norm(quaternion, axis=1, keepdims=True)
    rotation = np.full((stamps_ns.size, 3, 3), np.nan)
    sound = np.isfinite(unit).all(axis=1)
    rotation[sound] = rotation_from_quaternion(unit[sound])
    return body_velocities(stamps_ns, position, rotation)


def arc(stamps_ns: NDArray[np.int64], v: float, omega: float) -> tuple[Floats, Floats]:
    """Poses on an arc of constant velocity, from the origin at 1 s."""
    t = (stamps_ns - 1_000_000_000) * 1e-9
    yaw = omega * t
    chord = v * t * np.sinc(yaw / 2 / np.pi)
    position = np.stack([chord * np.cos(yaw / 2), chord * np.sin(yaw / 2), 0 * t], axis=1)
    zero = np.zeros_like(t)
    return position, np.stack([zero, zero, np.sin(yaw / 2), np.cos(yaw / 2)], axis=1)


def stamps(count: int, jitter: float = 0.0) -> NDArray[np.int64]:
    shift = np.random.default_rng(0).uniform(-jitter, jitter, count)
    return (1e9 + (np.arange(count) + shift) * 2e7).astype(np.int64)


@given(st.floats(-2, 2), st.floats(-2, 2), st.sampled_from([0.0, 0.3]))
def test_an_arc_gives_its_velocities_back(v: float, omega: float, jitter: float) -> None:
    times = stamps(400, jitter)
    linear, yaw_rate = of_quaternions(times, *arc(times, v, omega))
    assert linear == pytest.approx(np.full(400, v), abs=2e-3)
    assert yaw_rate == pytest.approx(np.full(400, omega), abs=1e-5)


def test_backwards_is_negative_whatever_the_heading() -> None:
    times = stamps(10)
    position = np.zeros((10, 3))
    position[:, 1] = 0.02 * np.arange(10)
    facing_south = np.tile([0.0, 0.0, -np.sqrt(0.5), np.sqrt(0.5)], (10, 1))
    linear, yaw_rate = of_quaternions(times, position, facing_south)
    assert linear == pytest.approx(np.full(10, -1.0))
    assert yaw_rate == pytest.approx(np.zeros(10))


def test_climbing_counts_along_the_body() -> None:
    times = stamps(10)
    pitch = -0.3
    position = np.outer(np.arange(10) * 0.02, [np.cos(pitch), 0.0, -np.sin(pitch)])
    quaternion = np.tile([0.0, np.sin(pitch / 2), 0.0, np.cos(pitch / 2)], (10, 1))
    linear, _ = of_quaternions(times, position, quaternion)
    assert linear == pytest.approx(np.ones(10))


def test_order_duplicates_and_sign_of_the_quaternion_do_not_matter() -> None:
    times = np.repeat(stamps(50), 2)
    position, quaternion = arc(times, 1.0, 1.0)
    quaternion[::3] *= -2.0
    expected = of_quaternions(times[::2], position[::2], quaternion[::2])
    shuffle = np.random.default_rng(3).permutation(times.size)
    found = of_quaternions(times[shuffle], position[shuffle], quaternion[shuffle])
    for have, want in zip(found, expected, strict=True):
        assert have == pytest.approx(np.repeat(want, 2)[shuffle])


@pytest.mark.parametrize("broken", ["position", "quaternion", "nan quaternion"])
def test_a_pose_that_is_none_is_left_out(broken: str) -> None:
    times = stamps(50)
    position, quaternion = arc(times, 1.0, 0.5)
    if broken == "position":
        position[20, 1] = np.nan
    else:
        quaternion[20] = 0.0 if broken == "quaternion" else np.nan
    linear, yaw_rate = of_quaternions(times, position, quaternion)
    assert np.flatnonzero(np.isnan(linear)).tolist() == [20]
    assert np.nanmax(np.abs(linear - 1.0)) < 1e-3
    assert np.nanmax(np.abs(yaw_rate - 0.5)) < 1e-5


@given(st.floats(0.0, 0.6), st.floats(-3, 3), st.sampled_from([20.0, 50.0, 200.0]))
@settings(max_examples=15, deadline=None)
def test_a_drive_on_a_slope_gives_its_velocities_back(
    slope: float, heading: float, rate: float
) -> None:
    truth = replace(CURVES, slope=slope, heading=heading).at(times(6, rate))
    since = np.rint(truth.seconds * 1e9).astype(np.int64)
    linear, yaw_rate = body_velocities(since, truth.position, truth.rotation)
    inner = slice(12, -12)
    assert linear[inner] == pytest.approx(truth.linear[inner, 0], abs=1e-3)
    assert yaw_rate[inner] == pytest.approx(truth.angular[inner, 2], abs=1e-3)


@pytest.mark.parametrize(("held", "rate"), [(10.0, 100.0), (10.0, 50.0), (20.0, 200.0)])
def test_a_pose_that_is_held_until_the_next_one_comes_is_no_standstill(
    held: float, rate: float
) -> None:
    seconds = times(6, rate)
    since = np.rint(seconds * 1e9).astype(np.int64)
    shown = CURVES.at(np.floor(seconds * held + 1e-6) / held)
    linear, yaw_rate = body_velocities(since, shown.position, shown.rotation)
    truth = CURVES.at(seconds)
    assert linear == pytest.approx(truth.linear[:, 0], abs=0.025)
    assert yaw_rate == pytest.approx(truth.angular[:, 2], abs=0.015)


def test_a_robot_that_stops_and_goes_on_stands_in_between() -> None:
    stops = Drive(speed=lambda t: np.where((t > 2) & (t < 4), 0.0, 0.5), yaw_rate=lambda t: 0 * t)
    truth = stops.at(times(6, 50))
    since = np.rint(truth.seconds * 1e9).astype(np.int64)
    linear, _ = body_velocities(since, truth.position, truth.rotation)
    assert np.abs(linear[110:190]).max() == 0
    assert linear[[50, 250]] == pytest.approx([0.5, 0.5])


@pytest.mark.parametrize("rate", [50.0, 200.0])
def test_a_millimetre_of_noise_costs_some_centimetres_a_second_at_any_rate(rate: float) -> None:
    truth = CURVES.at(times(9, rate))
    since = np.rint(truth.seconds * 1e9).astype(np.int64)
    noise = np.random.default_rng(1).normal(0, 1e-3, truth.position.shape)
    linear, _ = body_velocities(since, truth.position + noise, truth.rotation)
    assert np.std(linear[20:-20] - truth.linear[20:-20, 0]) < 0.02


@pytest.mark.parametrize("count", [0, 1])
def test_fewer_than_two_stamps_give_nan(count: int) -> None:
    times = stamps(count)
    for values in of_quaternions(times, *arc(times, 1.0, 0.0)):
        assert values.shape == (count,)
        assert np.isnan(values).all()


def test_real_poses_give_the_velocities_of_the_street(
    real_messages: Callable[[str, str], Any],
) -> None:
    messages = real_messages("kitti_street_camera_lidar_odometry", "/odometry")
    motions = [decode_motion(message, kind, "/odometry") for message, kind in messages]
    linear, yaw_rate = of_quaternions(
        np.array([motion.stamp_ns for motion in motions]),
        np.array([motion.position for motion in motions]),
        np.array([motion.quaternion for motion in motions]),
    )
    # Its twist was made of its poses by central differences, at the ends by one-sided ones.
    told = np.array([(motion.linear_velocity, motion.yaw_rate) for motion in motions])[1:-1]
    assert linear[1:-1] == pytest.approx(told[:, 0], abs=1e-3)
    assert yaw_rate[1:-1] == pytest.approx(told[:, 1], abs=1e-5)
