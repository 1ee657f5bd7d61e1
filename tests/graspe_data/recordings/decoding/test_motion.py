from __future__ import annotations

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from graspe_data.errors import RecordingError
from graspe_data.recordings.decoding import decode_motion, decode_transforms
from graspe_data.sensor_data import Motion, StampedTransform

STAMP = 12_000_000_034
POSITION, QUATERNION = (1.0, 2.0, 3.0), (0.0, 0.0, 0.6, 0.8)
LINEAR, ANGULAR = (0.5, 0.1, 0.2), (0.3, 0.4, -0.7)
TWIST = (0.5, 0.1, 0.2, 0.3, 0.4, -0.7)


def with_covariance(build: Any, kind: str, name: str, content: Any) -> Any:
    return build(kind, **{name: content, "covariance": np.zeros(36)})


def test_odometry_gives_the_pose_and_the_velocity_in_the_body(build: Any) -> None:
    pose = build.pose(POSITION, QUATERNION)
    message = build(
        "nav_msgs/msg/Odometry",
        header=build.header("odom"),
        child_frame_id="base_link",
        pose=with_covariance(build, "geometry_msgs/msg/PoseWithCovariance", "pose", pose),
        twist=with_covariance(
            build, "geometry_msgs/msg/TwistWithCovariance", "twist", build.twist(LINEAR, ANGULAR)
        ),
    )
    expected = Motion(STAMP, "odom", "base_link", POSITION, QUATERNION, 0.5, -0.7, TWIST)
    assert decode_motion(message, "nav_msgs/msg/Odometry", "/odom") == expected


def test_a_bare_twist_has_no_stamp_and_no_pose(build: Any) -> None:
    motion = decode_motion(build.twist(LINEAR, ANGULAR), "geometry_msgs/msg/Twist", "/cmd_vel")
    assert motion == Motion(None, "", "", None, None, 0.5, -0.7, TWIST)


@pytest.mark.parametrize("covariance", [False, True])
def test_a_stamped_twist_has_no_pose(build: Any, covariance: bool) -> None:
    twist = build.twist(LINEAR, ANGULAR)
    kind = "geometry_msgs/msg/TwistStamped"
    if covariance:
        kind = "geometry_msgs/msg/TwistWithCovarianceStamped"
        twist = with_covariance(build, "geometry_msgs/msg/TwistWithCovariance", "twist", twist)
    motion = decode_motion(build(kind, header=build.header(), twist=twist), kind, "/twist")
    assert motion == Motion(STAMP, "sensor", "sensor", None, None, 0.5, -0.7, TWIST)


@pytest.mark.parametrize("covariance", [False, True])
def test_a_stamped_pose_has_no_velocity(build: Any, covariance: bool) -> None:
    pose = build.pose(POSITION, QUATERNION)
    kind = "geometry_msgs/msg/PoseStamped"
    if covariance:
        kind = "geometry_msgs/msg/PoseWithCovarianceStamped"
        pose = with_covariance(build, "geometry_msgs/msg/PoseWithCovariance", "pose", pose)
    motion = decode_motion(build(kind, header=build.header(), pose=pose), kind, "/pose")
    assert motion == Motion(STAMP, "sensor", "", POSITION, QUATERNION, None, None)


def test_another_type_tells_no_motion(build_ros2: Any) -> None:
    with pytest.raises(RecordingError, match="/imu: sensor_msgs/msg/Imu tells no motion"):
        decode_motion(build_ros2.header(), "sensor_msgs/msg/Imu", "/imu")


def test_transforms_are_edges_from_parent_to_child(build: Any) -> None:
    transform = build(
        "geometry_msgs/msg/Transform",
        translation=build.vector(*POSITION),
        rotation=build.pose(POSITION, QUATERNION).orientation,
    )
    edge = build(
        "geometry_msgs/msg/TransformStamped",
        header=build.header("/odom"),
        child_frame_id="base_link",
        transform=transform,
    )
    message = SimpleNamespace(transforms=[edge, edge])
    expected = StampedTransform(STAMP, "/odom", "base_link", POSITION, QUATERNION)
    assert decode_transforms(message) == [expected, expected]


def test_real_odometry(real_messages: Callable[[str, str], Any]) -> None:
    topic = "/husky_velocity_controller/odom"
    messages = real_messages("husky_odom_imu_gps_bz2.bag", topic)
    motions = [decode_motion(message, kind, topic) for message, kind in messages]
    assert len(motions) == 3952
    assert {(motion.frame, motion.child_frame) for motion in motions} == {("odom", "base_link")}
    positions = np.array([motion.position for motion in motions])
    path = np.linalg.norm(np.diff(positions, axis=0), axis=1).sum()
    assert path == pytest.approx(358.8, abs=0.5)


def test_real_transforms(real_messages: Callable[[str, str], Any]) -> None:
    messages = real_messages("kitti_street_camera_lidar_odometry", "/tf_static")
    edges = [edge for message, _ in messages for edge in decode_transforms(message)]
    assert [(edge.parent, edge.child) for edge in edges] == [
        ("base_link", "velo_link"),
        ("velo_link", "camera_color_left"),
    ]
    assert edges[0].translation[2] == pytest.approx(1.73)
