"""Odometry between its samples."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from graspe_data.errors import ObservationError
from graspe_data.observation.odometry_series import PoseSeries, odometry_series, sample_odometry

SECOND = 1_000_000_000
NAN = float("nan")


def series(
    stamps_s: list[float],
    yaw: list[float] | None = None,
    velocity: list[tuple[float, float]] | None = None,
) -> PoseSeries:
    stamps = np.rint(np.array(stamps_s) * SECOND).astype(np.int64)
    count = stamps.size
    position: NDArray[np.float64] = np.full((count, 3), NAN)
    quaternion = np.full((count, 4), NAN)
    if yaw is not None:
        half = np.array(yaw) / 2
        position = np.zeros((count, 3))
        position[:, 0] = stamps / SECOND
        quaternion = np.stack([0 * half, 0 * half, np.sin(half), np.cos(half)], axis=1)
    twist = np.array(velocity if velocity is not None else [(1.0, 0.0)] * count)
    usable = np.isfinite(quaternion).all(axis=1) | (yaw is None)
    return odometry_series(stamps[usable], position[usable], quaternion[usable], twist[usable])


def at(*seconds: float) -> NDArray[np.int64]:
    stamps: NDArray[np.int64] = np.rint(np.array(seconds) * SECOND).astype(np.int64)
    return stamps


def test_poses_and_velocities_are_interpolated_between_neighbours() -> None:
    samples = sample_odometry(
        series([0, 0.1], [0, 0.2], [(1, 0), (2, 0.4)]), at(0.025), maximum_gap_s=0.2
    )
    np.testing.assert_allclose(samples.pose[0, [0, 5]], [0.025, 0.05])
    np.testing.assert_allclose(samples.velocity[0], [1.25, 0.1])
    assert samples.known.all()
    assert samples.age_ns[0] == SECOND // 40


def test_yaw_goes_the_short_way_round() -> None:
    samples = sample_odometry(series([0, 0.1], [3.1, -3.1]), at(0.05), maximum_gap_s=0.2)
    assert abs(samples.pose[0, 5]) == pytest.approx(np.pi, abs=1e-6)


def test_inside_a_gap_nothing_is_known_but_its_ends() -> None:
    samples = sample_odometry(
        series([0, 0.1, 1.1, 1.2], [0] * 4), at(0.1, 0.5, 1.1, 1.15), maximum_gap_s=0.2
    )
    assert samples.known.tolist() == [True, False, True, True]


def test_outside_the_recording_nothing_is_known() -> None:
    samples = sample_odometry(series([1, 1.1], [0, 0]), at(0.9, 1.2), maximum_gap_s=0.2)
    assert not samples.known.any()


def test_samples_out_of_order_repeated_or_not_finite_are_put_right() -> None:
    made = series([0.2, 0.0, 0.1, 0.1, 0.3], [0, 0, 0, 0, NAN])
    np.testing.assert_array_equal(made.stamps_ns, at(0, 0.1, 0.2))


def test_a_twist_alone_is_integrated_along_its_arcs() -> None:
    count, omega = 101, 0.5
    made = series(list(np.linspace(0, 2, count)), velocity=[(1.0, omega)] * count)
    expected = np.sin(omega * 2) / omega, (1 - np.cos(omega * 2)) / omega
    np.testing.assert_allclose(made.pose[-1, :2], expected, atol=1e-4)
    assert made.pose[-1, 5] == pytest.approx(omega * 2)


def test_one_sample_is_not_enough() -> None:
    with pytest.raises(ObservationError, match=r"1 usable odometry samples of 1"):
        series([0], [0])
