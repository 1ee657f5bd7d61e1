"""Where the goal is, as the robot sees it."""

from __future__ import annotations

import numpy as np

from graspe_data.arrays import Floats
from planners.situation import Situation


def goal_in_base(situation: Situation) -> Floats:
    """The goal (2,) in base_link, metres."""
    return goal_seen_from(situation.pose, situation.goal)


def goal_seen_from(pose: tuple[float, float, float], goal: tuple[float, float]) -> Floats:
    """A goal (2,), metres, as seen from a pose of x, y in metres and yaw in rad in its frame."""
    x, y, yaw = pose
    east, north = goal[0] - x, goal[1] - y
    cosine, sine = np.cos(yaw), np.sin(yaw)
    return np.array([cosine * east + sine * north, cosine * north - sine * east])


def heading_error(poses: Floats, goal: Floats) -> Floats:
    """Angle to the goal from poses (..., 3) in base_link, rad in [-pi, pi), positive to the left.

    Args:
        poses: x, y in metres and yaw in rad.
        goal: (2,), base_link, metres.
    """
    bearing = np.arctan2(goal[1] - poses[..., 1], goal[0] - poses[..., 0])
    error: Floats = (bearing - poses[..., 2] + np.pi) % (2 * np.pi) - np.pi
    return error
