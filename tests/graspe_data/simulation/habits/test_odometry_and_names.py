"""Odometry in the wrong frame or half empty, and names that differ: undone, nothing is lost."""

from __future__ import annotations

import numpy as np
import pytest

from graspe_data.recordings.decoding import decode_motion
from graspe_data.simulation.habits.message_parts import pose_of, vector
from graspe_data.simulation.habits.odometry import (
    poses_never_filled,
    twist_in_odometry_frame,
    twist_never_filled,
)
from graspe_data.simulation.habits.recorded import (
    Recorded,
    frames_renamed,
    left_out,
    topics_renamed,
    with_habits,
)
from tests.graspe_data.simulation.habits.conftest import IMAGE, ODOMETRY, POINTS, on


def test_a_twist_in_the_odometry_frame_is_the_bodys_turned_by_the_pose(
    plain: list[Recorded],
) -> None:
    before = on(plain, ODOMETRY)
    after = on(with_habits(plain, [twist_in_odometry_frame(ODOMETRY)]), ODOMETRY)
    assert len(after) == len(before) > 50
    for told, truth in zip(after, before, strict=True):
        rotation = pose_of(told).rotation
        for part in ("linear", "angular"):
            turned = vector(getattr(told.twist.twist, part))
            body = vector(getattr(truth.twist.twist, part))
            np.testing.assert_allclose(rotation.T @ turned, body, atol=1e-12)
        assert told.pose == truth.pose
    sideways = [abs(told.twist.twist.linear.y) for told in after]
    assert max(sideways) > 0.05


def test_only_the_half_that_is_never_filled_is_zero(plain: list[Recorded]) -> None:
    (truth, *_) = on(plain, ODOMETRY)[30:]
    (still, *_) = on(with_habits(plain, [twist_never_filled(ODOMETRY)]), ODOMETRY)[30:]
    assert still.pose == truth.pose
    motion = decode_motion(still, "nav_msgs/msg/Odometry", ODOMETRY)
    assert (motion.linear_velocity, motion.yaw_rate) == (0.0, 0.0)
    (lost, *_) = on(with_habits(plain, [poses_never_filled(ODOMETRY)]), ODOMETRY)[30:]
    assert lost.twist == truth.twist
    motion = decode_motion(lost, "nav_msgs/msg/Odometry", ODOMETRY)
    assert (motion.position, motion.quaternion) == ((0, 0, 0), (0, 0, 0, 1))


def test_the_quaternion_that_ros_1_never_fills_has_no_length(plain: list[Recorded]) -> None:
    lost = on(with_habits(plain, [poses_never_filled(ODOMETRY, w=0.0)]), ODOMETRY)[0]
    orientation = lost.pose.pose.orientation
    assert (orientation.x, orientation.y, orientation.z, orientation.w) == (0, 0, 0, 0)


def test_frames_are_renamed_wherever_they_stand(plain: list[Recorded]) -> None:
    names = {"odom": "spot/odom", "base_link": "spot/body"}
    stream = list(with_habits(plain, [frames_renamed(names)]))
    odometry = on(stream, ODOMETRY)[0]
    assert (odometry.header.frame_id, odometry.child_frame_id) == ("spot/odom", "spot/body")
    (edge,) = on(stream, "/tf")[0].transforms
    assert (edge.header.frame_id, edge.child_frame_id) == ("spot/odom", "spot/body")
    assert {edge.header.frame_id for edge in on(stream, "/tf_static")[0].transforms} == {
        "spot/body"
    }
    assert on(stream, POINTS)[0].header.frame_id == "velodyne"
    assert [m.bag_time_ns for m in stream] == [m.bag_time_ns for m in plain]


def test_topics_move_under_a_namespace_and_others_stay(plain: list[Recorded]) -> None:
    stream = list(with_habits(plain, [topics_renamed({"/tf_static": "/robot1/tf_static"})]))
    assert on(stream, "/robot1/tf_static") == on(plain, "/tf_static")
    assert not on(stream, "/tf_static")
    assert len(on(stream, IMAGE)) == len(on(plain, IMAGE)) > 0


@pytest.mark.parametrize("topic", ["/tf_static", POINTS])
def test_a_topic_that_nobody_recorded_is_gone_alone(plain: list[Recorded], topic: str) -> None:
    stream = list(with_habits(plain, [left_out(topic)]))
    assert stream == [message for message in plain if message.topic != topic]
