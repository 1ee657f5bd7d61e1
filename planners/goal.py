"""The goal: where the robot sees it, whether it is there, and whether it still gets nearer."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from pydantic import Field

from graspe_data.arrays import Floats
from graspe_data.manifest import Settings
from planners.situation import Pose, Situation


def goal_in_base(situation: Situation) -> Floats:
    """The goal (2,) in base_link, metres."""
    return goal_seen_from(situation.pose, situation.goal)


def goal_seen_from(pose: Pose, goal: tuple[float, float]) -> Floats:
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


LONGEST_STEP_S = 1.0
"""A longer time between two questions is a pause, and counts as no more than this."""


class GoalSettings(Settings):
    """When a robot has arrived, and when it is given up."""

    radius: Annotated[float, Field(gt=0, le=100)] = 0.5
    """Metres from the goal to base_link at which the robot has arrived; it then stands until it is
    given another goal, or has been moved twice as far."""
    progress_m: Annotated[float, Field(gt=0, le=1000)] = 0.5
    """Metres by which it has to get nearer to the goal than it ever was..."""
    progress_s: Annotated[float, Field(gt=0, le=1e6)] = 60.0
    """...within so many seconds of driving, or it stands until it is given another goal."""


@dataclass(frozen=True)
class Standing:
    """Why a robot stands that could drive: it has ``arrived``, or it makes no progress."""

    reason: str
    arrived: bool


class GoalWatch:
    """Watches the way to one goal after another.

    A goal that moves by less than twice the radius is the same.

    Time counts while planners are asked; a pause, or a time without fit sensor data, does not.
    """

    def __init__(self, settings: GoalSettings) -> None:
        """Begin without a goal."""
        self._settings = settings
        self._goal: tuple[float, float] | None = None
        self._nearest, self._spent_s, self._asked_ns = math.inf, 0.0, 0
        self._arrived = False

    def standing(self, situation: Situation) -> Standing | None:
        """Why the robot has to stand; None while it is on its way."""
        settings, goal = self._settings, situation.goal
        if self._goal is None or math.dist(goal, self._goal) > 2 * settings.radius:
            self._goal, self._nearest, self._spent_s = goal, math.inf, 0.0
            self._asked_ns, self._arrived = situation.now_ns, False
        away = math.dist(goal, situation.pose[:2])
        self._arrived = away <= settings.radius * (2 if self._arrived else 1)
        if self._arrived:
            return Standing(f"arrived: {away:.2f} m from the goal", arrived=True)
        self._count(situation.now_ns, away)
        if self._spent_s < settings.progress_s:
            return None
        return Standing(
            f"no progress: no nearer to the goal than {self._nearest:.2f} m for "
            f"{settings.progress_s:g} s",
            arrived=False,
        )

    def _count(self, now_ns: int, away: float) -> None:
        passed_s, self._asked_ns = (now_ns - self._asked_ns) / 1e9, now_ns
        self._spent_s += min(max(passed_s, 0.0), LONGEST_STEP_S)
        if away <= self._nearest - self._settings.progress_m:
            self._nearest, self._spent_s = away, 0.0
