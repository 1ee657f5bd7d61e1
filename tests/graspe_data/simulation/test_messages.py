"""Messages, read back by the decoders that read real recordings."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from graspe_data.geometry import Transform, rotation_from_quaternion, rotation_from_rpy
from graspe_data.manifest import find_manifest, load_manifest
from graspe_data.recordings.decoding import (
    decode_calibration,
    decode_image,
    decode_inertial,
    decode_motion,
    decode_points,
    decode_transforms,
)
from graspe_data.robot import Intrinsics, Robot
from graspe_data.simulation.camera.develop import encode_jpeg
from graspe_data.simulation.lidar.beams import POINT_TYPE
from graspe_data.simulation.messages import Messages

STAMP = 1_700_000_012_345_678_901
POSE = Transform(rotation_from_rpy(0.1, -0.2, 2.5), np.array([3.0, -1.0, 0.55]))


@pytest.fixture(scope="module")
def spot() -> Robot:
    return load_manifest(find_manifest("robots", "spot"), Robot)


@pytest.fixture(scope="module")
def messages(spot: Robot) -> Messages:
    return Messages(spot)


def stamp_of(message: Any) -> int:
    return int(message.header.stamp.sec) * 10**9 + int(message.header.stamp.nanosec)


def test_odometry_is_a_pose_with_tilt_and_a_velocity(messages: Messages) -> None:
    said = messages.odometry(STAMP, POSE, 0.4, -0.3)
    motion = decode_motion(said, "nav_msgs/msg/Odometry", "/odom")
    assert motion.stamp_ns == STAMP
    assert motion.position == pytest.approx((3.0, -1.0, 0.55))
    assert motion.quaternion is not None
    turned = rotation_from_quaternion(np.array(motion.quaternion))
    np.testing.assert_allclose(turned, POSE.rotation, atol=1e-12)
    assert (motion.linear_velocity, motion.yaw_rate) == (0.4, -0.3)
    assert (said.header.frame_id, said.child_frame_id) == ("odom", "base_link")


def test_the_imu_says_what_it_feels_and_that_it_knows_no_orientation(messages: Messages) -> None:
    said = messages.inertial(STAMP, np.array([0.1, 0.2, 9.8]), np.array([0.01, 0.02, 0.3]))
    sample = decode_inertial(said, "/imu")
    assert tuple(sample.linear_acceleration) == (0.1, 0.2, 9.8)
    assert tuple(sample.angular_velocity) == (0.01, 0.02, 0.3)
    assert said.orientation_covariance[0] == -1.0


def test_a_command_is_a_twist(messages: Messages) -> None:
    said = messages.twist(0.5, -0.2)
    assert (said.linear.x, said.linear.y, said.angular.z) == (0.5, 0.0, -0.2)


def test_transforms_come_back_by_their_frames(messages: Messages) -> None:
    said = messages.transforms(STAMP, {("odom", "base_link"): POSE})
    (edge,) = decode_transforms(said)
    assert (edge.parent, edge.child) == ("odom", "base_link")
    again = Transform.from_quaternion(np.array(edge.translation), np.array(edge.quaternion))
    np.testing.assert_allclose(again.rotation, POSE.rotation, atol=1e-12)
    np.testing.assert_array_equal(again.translation, POSE.translation)


def test_the_calibration_is_the_pinhole_given(messages: Messages) -> None:
    camera = Intrinsics(width=320, height=240, fx=240.0, fy=241.0, cx=159.5, cy=119.5)
    decoded = decode_calibration(messages.calibration(STAMP, camera), "/info").intrinsics
    assert decoded.model_dump() == camera.model_dump()


def test_a_picture_is_read_back_as_the_jpeg_shows_it(messages: Messages) -> None:
    grey = np.linspace(0, 255, 64, dtype=np.uint8)
    rgb = np.stack([np.tile(grey, (48, 1)), np.full((48, 64), 90), np.full((48, 64), 30)], axis=-1)
    said = messages.picture(STAMP, encode_jpeg(rgb.astype(np.uint8), 95))
    decoded = decode_image(said, "sensor_msgs/msg/CompressedImage", "/image")
    assert (decoded.stamp_ns, decoded.frame) == (STAMP, "camera_optical")
    assert np.abs(decoded.rgb.astype(int) - rgb).mean() < 3


def test_a_cloud_is_read_back_to_the_bit(messages: Messages) -> None:
    points = np.zeros(50, POINT_TYPE)
    draw = np.random.default_rng(0)
    for name in ("x", "y", "z", "intensity", "time"):
        points[name] = draw.uniform(0, 10, 50)
    points["ring"] = np.arange(50) % 16
    cloud = decode_points(messages.cloud(STAMP, points), "/points")
    assert (cloud.stamp_ns, cloud.frame) == (STAMP, "velodyne")
    np.testing.assert_array_equal(cloud.xyz, np.stack([points[axis] for axis in "xyz"], axis=1))
    np.testing.assert_array_equal(cloud.intensity, points["intensity"])
    np.testing.assert_array_equal(cloud.ring, points["ring"])


def test_frames_are_those_of_the_robots_manifest(spot: Robot) -> None:
    other = spot.model_copy(
        update={
            "base_frame": "body",
            "odometry_frame": "world",
            "camera": spot.camera.model_copy(update={"frame": "eye"}),
            "lidar": spot.lidar.model_copy(update={"frame": "laser"}),
        }
    )
    messages = Messages(other)
    said = messages.odometry(STAMP, POSE, 0.0, 0.0)
    assert (said.header.frame_id, said.child_frame_id) == ("world", "body")
    assert messages.picture(STAMP, b"").header.frame_id == "eye"
    assert messages.cloud(STAMP, np.zeros(1, POINT_TYPE)).header.frame_id == "laser"


def test_stamps_are_whole_nanoseconds(messages: Messages) -> None:
    assert stamp_of(messages.picture(STAMP, b"")) == STAMP
