from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from graspe_data.errors import RecordingError
from graspe_data.recordings.decoding import decode_inertial, decode_scan


def imu(build: Any, gyro_covariance: float = 0.0, acceleration_covariance: float = 0.0) -> Any:
    return build(
        "sensor_msgs/msg/Imu",
        header=build.header("imu_link"),
        orientation=build.pose((0, 0, 0), (0, 0, 0, 1)).orientation,
        orientation_covariance=np.full(9, -1.0),
        angular_velocity=build.vector(0.1, 0.2, 0.3),
        angular_velocity_covariance=np.full(9, gyro_covariance),
        linear_acceleration=build.vector(1.0, 2.0, 9.8),
        linear_acceleration_covariance=np.full(9, acceleration_covariance),
    )


def test_an_imu_gives_rates_and_accelerations(build: Any) -> None:
    sample = decode_inertial(imu(build), "/imu")
    assert (sample.stamp_ns, sample.frame) == (12_000_000_034, "imu_link")
    assert sample.angular_velocity == (0.1, 0.2, 0.3)
    assert sample.linear_acceleration == (1.0, 2.0, 9.8)


def test_what_an_imu_does_not_measure_is_nan(build: Any) -> None:
    without_gyro = decode_inertial(imu(build, gyro_covariance=-1.0), "/imu")
    assert all(map(math.isnan, without_gyro.angular_velocity))
    without_acceleration = decode_inertial(imu(build, acceleration_covariance=-1.0), "/imu")
    assert all(map(math.isnan, without_acceleration.linear_acceleration))
    with pytest.raises(RecordingError, match=r"/imu.*neither"):
        decode_inertial(imu(build, -1.0, -1.0), "/imu")


def scan(build: Any, ranges: list[float], increment: float = 0.5, start: float = -1.0) -> Any:
    return build(
        "sensor_msgs/msg/LaserScan",
        header=build.header("laser"),
        angle_min=start,
        angle_max=1.0,
        angle_increment=increment,
        time_increment=0.0,
        scan_time=0.1,
        range_min=0.1,
        range_max=10.0,
        ranges=np.array(ranges, np.float32),
        intensities=np.zeros(0, np.float32),
    )


def test_a_scan_keeps_its_ranges_as_published(build: Any) -> None:
    ranges = [1.0, math.nan, math.inf, 0.0]
    decoded = decode_scan(scan(build, ranges), "/scan")
    assert (decoded.angle_minimum, decoded.angle_increment) == (-1.0, 0.5)
    assert decoded.ranges.dtype == np.float32
    np.testing.assert_array_equal(decoded.ranges, np.array(ranges, np.float32))


@pytest.mark.parametrize(("start", "increment"), [(0.0, 0.0), (math.nan, 0.1), (0.0, math.inf)])
def test_a_scan_without_angles_is_refused(build: Any, start: float, increment: float) -> None:
    with pytest.raises(RecordingError, match=r"/scan, header stamp .* 2 rays"):
        decode_scan(scan(build, [1.0, 2.0], increment, start), "/scan")


def test_a_scan_of_one_ray_needs_no_step(build: Any) -> None:
    assert decode_scan(scan(build, [1.0], 0.0), "/scan").ranges.tolist() == [1.0]


def test_real_imu(real_messages: Callable[[str, str], Any]) -> None:
    messages = real_messages("husky_odom_imu_gps_bz2.bag", "/imu/data")
    samples = [decode_inertial(message, "/imu/data") for message, _ in messages]
    assert len(samples) == 11865
    mean = np.mean([sample.linear_acceleration for sample in samples], axis=0)
    assert np.linalg.norm(mean) == pytest.approx(9.81, abs=0.3)


def test_real_scans(real_messages: Callable[[str, str], Any]) -> None:
    messages = real_messages("zaki_scan_odom_tf_clockdrift.bag", "/scan")
    scans = [decode_scan(message, "/scan") for message, _ in messages]
    assert {len(scan.ranges) for scan in scans} == {726}
    assert len(scans) == 920
