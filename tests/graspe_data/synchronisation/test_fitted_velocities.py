from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.signal import savgol_filter

from graspe_data.geometry import rotation_from_quaternion
from graspe_data.synchronisation.differentiate import body_velocities
from graspe_data.synchronisation.fitted_velocities import fitted_velocities

Floats = NDArray[np.float64]
Stamps = NDArray[np.int64]


def stamps(count: int, jitter: float = 0.0) -> Stamps:
    shift = np.random.default_rng(0).uniform(-jitter, jitter, count)
    return (1e18 + (np.arange(count) + shift) * 1e8).astype(np.int64)


def arc(times: Stamps, v: float, omega: float) -> tuple[Floats, Floats]:
    t = (times - times[:1]) * 1e-9
    yaw = omega * t
    chord = v * t * np.sinc(yaw / 2 / np.pi)
    position = np.stack([chord * np.cos(yaw / 2), chord * np.sin(yaw / 2), 0 * t], axis=1)
    zero = np.zeros_like(t)
    return position, np.stack([zero, zero, np.sin(yaw / 2), np.cos(yaw / 2)], axis=1)


@given(st.floats(-2, 2), st.floats(-1, 1), st.sampled_from([0.0, 0.3]))
def test_an_arc_gives_its_velocities_back(v: float, omega: float, jitter: float) -> None:
    times = stamps(100, jitter)
    velocity = fitted_velocities(times, *arc(times, v, omega))
    assert velocity[:, 0] == pytest.approx(np.full(100, v), abs=5e-2 * abs(v) * omega**2 + 1e-6)
    assert velocity[:, 1] == pytest.approx(np.full(100, omega), abs=1e-6)


def test_along_a_line_it_is_the_filter_of_savitzky_and_golay() -> None:
    times = stamps(60)
    along = np.cumsum(np.random.default_rng(1).normal(0.1, 0.02, 60))
    position = np.stack([along, 0 * along, 0 * along], axis=1)
    facing = np.tile([0.0, 0.0, 0.0, 1.0], (60, 1))
    known = savgol_filter(along, 5, 2, deriv=1, delta=0.1)
    found = fitted_velocities(times, position, facing)[:, 0]
    assert found[2:-2] == pytest.approx(known[2:-2], abs=1e-9)


def test_noise_of_two_centimetres_and_half_a_degree_is_less_than_half_of_a_difference_s() -> None:
    """.064 against .141 m/s, .028 against .062 rad/s."""
    times = stamps(3000)
    random = np.random.default_rng(2)
    position = random.normal(0, 0.02, (3000, 3))
    half = random.normal(0, np.deg2rad(0.5), 3000) / 2
    quaternion = np.stack([0 * half, 0 * half, np.sin(half), np.cos(half)], axis=1)
    fitted = fitted_velocities(times, position, quaternion)[2:-2].std(axis=0)
    plain = body_velocities(times, position, rotation_from_quaternion(quaternion))
    assert fitted == pytest.approx([0.02 / 0.1 / np.sqrt(10), np.deg2rad(0.5) * np.sqrt(10)], 0.1)
    assert fitted[0] < 0.5 * plain[0].std()
    assert fitted[1] < 0.5 * plain[1].std()


def test_it_shifts_nothing_in_time() -> None:
    times = stamps(21)
    along = 0.5 * ((np.arange(21) - 10) * 0.1) ** 2
    position = np.stack([along, 0 * along, 0 * along], axis=1)
    found = fitted_velocities(times, position, np.tile([0.0, 0.0, 0.0, 1.0], (21, 1)))[:, 0]
    assert found == pytest.approx((np.arange(21) - 10) * 0.1, abs=1e-9)


def test_heading_may_turn_over_and_the_quaternion_s_sign_does_not_matter() -> None:
    times = stamps(100)
    position, quaternion = arc(times, 1.0, 0.9)
    quaternion[::3] *= -1
    velocity = fitted_velocities(times, position, quaternion)
    assert velocity[:, 1] == pytest.approx(np.full(100, 0.9), abs=1e-6)


def test_what_is_no_pose_has_no_velocity_and_is_no_neighbour() -> None:
    times = stamps(40)
    position, quaternion = arc(times, 1.0, 0.2)
    position[10], quaternion[20:22] = np.nan, np.nan
    velocity = fitted_velocities(times, position, quaternion)
    assert np.flatnonzero(np.isnan(velocity).all(axis=1)).tolist() == [10, 20, 21]
    assert np.nanmax(np.abs(velocity - [1.0, 0.2])) < 5e-3


def test_nothing_is_fitted_across_a_long_gap() -> None:
    times = stamps(20)
    times[10:] += 5_000_000_000
    position, quaternion = arc(stamps(20), 1.0, 0.0)
    position[10:] += 3.0
    velocity = fitted_velocities(times, position, quaternion)
    assert velocity[:, 0] == pytest.approx(np.ones(20), abs=1e-6)


@pytest.mark.parametrize("count", [0, 1])
def test_one_pose_has_no_velocity(count: int) -> None:
    velocity = fitted_velocities(stamps(count), *arc(stamps(count), 1.0, 0.0))
    assert velocity.shape == (count, 2)
    assert np.isnan(velocity).all()


def test_two_poses_give_a_line_and_one_stamp_none() -> None:
    times = stamps(2)
    assert fitted_velocities(times, *arc(times, 1.0, 0.0))[:, 0] == pytest.approx([1.0, 1.0])
    position, quaternion = arc(times, 1.0, 0.0)
    assert np.isnan(fitted_velocities(times[:1].repeat(2), position, quaternion)).all()
