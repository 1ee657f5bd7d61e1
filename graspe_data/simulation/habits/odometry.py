"""What drivers do to odometry: a twist in the wrong frame, or one half that is never filled."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from graspe_data.simulation.habits.message_parts import pose_of, vector, with_vector
from graspe_data.simulation.habits.recorded import Habit, changed


def twist_in_odometry_frame(topic: str) -> Habit:
    """The twist along the axes of ``header.frame_id``, where ROS has those of the child frame.

    Spot's drivers pass on ``velocity_of_body_in_odom``.
    """

    def turn(odometry: Any) -> Any:
        rotation, twist = pose_of(odometry).rotation, odometry.twist.twist
        linear = with_vector(twist.linear, rotation @ vector(twist.linear))
        angular = with_vector(twist.angular, rotation @ vector(twist.angular))
        return _with_twist(odometry, linear, angular)

    return changed(topic, turn)


def twist_never_filled(topic: str) -> Habit:
    """A twist of zeros, as lidar odometry publishes it."""

    def empty(odometry: Any) -> Any:
        twist, still = odometry.twist.twist, np.zeros(3)
        linear, angular = with_vector(twist.linear, still), with_vector(twist.angular, still)
        return _with_twist(odometry, linear, angular)

    return changed(topic, empty)


def poses_never_filled(topic: str, w: float = 1.0) -> Habit:
    """A pose of zeros.

    Args:
        topic: Of odometry.
        w: Of the quaternion that nobody set: 1 in ROS 2, 0 in ROS 1.
    """

    def empty(odometry: Any) -> Any:
        pose = odometry.pose.pose
        position = with_vector(pose.position, np.zeros(3))
        orientation = replace(pose.orientation, x=0.0, y=0.0, z=0.0, w=w)
        unset = replace(pose, position=position, orientation=orientation)
        return replace(odometry, pose=replace(odometry.pose, pose=unset))

    return changed(topic, empty)


def _with_twist(odometry: Any, linear: Any, angular: Any) -> Any:
    twist = replace(odometry.twist.twist, linear=linear, angular=angular)
    return replace(odometry, twist=replace(odometry.twist, twist=twist))
