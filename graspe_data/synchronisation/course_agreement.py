"""The course of a robot against its heading: whether it drives along its x axis."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from graspe_data.arrays import Floats
from graspe_data.errors import RecordingError
from graspe_data.robot import Robot
from graspe_data.synchronisation.findings import Finding
from graspe_data.synchronisation.motion_samples import SECOND, MotionSamples

_STEP_S: Final = 1.0
_SHORTEST_STEP_M: Final = 0.1
_SHARPEST_TURN_RAD: Final = 0.3
_TELLING_M: Final = 2.0
_MOSTLY: Final = 0.5
_COURSE_TURNS_RAD: Final = 0.5


@dataclass(frozen=True)
class Course:
    """Ways in metres, summed over seconds in which the robot hardly turns.

    ``ahead`` and ``back`` along body x, ``aside`` along body y, ``whole`` all of it.
    ``turn_rad`` is how far the direction of the way turned in the fixed frame, whichever end of the
    robot led.
    """

    ahead: float
    back: float
    aside: float
    whole: float
    turn_rad: float


def course_of(samples: MotionSamples) -> Course:
    """The course by the poses of a base frame; by its twist where there are no poses."""
    steps = [step for piece in samples.pieces for step in _steps(samples, piece.tolist())]
    body = np.array([inside for inside, _ in steps]).reshape(-1, 3)
    fixed = np.array([outside for _, outside in steps]).reshape(-1, 3)
    along, aside = body[:, 0], np.abs(body[:, 1])
    double = np.unwrap(2 * np.arctan2(fixed[:, 1], fixed[:, 0]))
    return Course(
        ahead=float(along[along > 0].sum()),
        back=float(-along[along < 0].sum()),
        aside=float(aside.sum()),
        whole=float(np.linalg.norm(body, axis=1).sum()),
        turn_rad=float(np.ptp(double)) / 2 if double.size else 0.0,
    )


def check_course(
    samples: MotionSamples, robot: Robot, *, heading_constant: bool, topic: str
) -> list[Finding]:
    """Hold the way of the base frame against where its x axis points.

    Args:
        samples: The motion of the base frame.
        robot: Its limits, and whether its manifest forces a choice: then nothing is refused.
        heading_constant: Whether the heading never changes, and velocities rest on it.
        topic: Of the odometry.

    Raises:
        RecordingError: The robot moves across its x axis, or on curves with one heading: the frame
            is none of a body whose x points ahead, or its heading was never filled.
    """
    course = course_of(samples)
    if course.whole < _TELLING_M:
        return []
    along = course.ahead + course.back
    numbers = {"along_m": along, "aside_m": course.aside, "way_m": course.whole}
    if along < _MOSTLY * course.whole or course.aside > _MOSTLY * course.whole:
        text = (
            f"{topic}: of {course.whole:.1f} m, {along:.1f} m lie along the robot's x axis and "
            f"{course.aside:.1f} m across: its frame is a camera's or another whose x does not "
            f"point ahead, or its heading was never filled"
        )
        return _told("moves_sideways", text, numbers, robot, topic)
    if heading_constant and course.turn_rad > _COURSE_TURNS_RAD:
        text = (
            f"{topic}: its way turns by {course.turn_rad:.2f} rad and its heading by none: the "
            f"heading was never filled, and no velocity can be told from the poses"
        )
        return _told("heading_never_filled", text, numbers, robot, topic)
    if course.back > course.ahead and robot.limits.linear_velocity[0] >= 0:
        text = (
            f"{topic}: {course.back:.1f} m backwards and {course.ahead:.1f} m ahead, and the "
            f"manifest's limits know no way back: is its frame turned about?"
        )
        numbers = {"ahead_m": course.ahead, "back_m": course.back}
        return [Finding("drives_backwards", "noted", topic, text, numbers)]
    return []


def _told(
    kind: str, text: str, numbers: dict[str, float], robot: Robot, topic: str
) -> list[Finding]:
    if robot.odometry_velocity != "checked":
        return [Finding(kind, "noted", topic, f"{text}; the robot manifest counts", numbers)]
    raise RecordingError(
        f"{text}. No rows are made. Publish where the base is in that frame, or name another "
        f"odometry under `topics.odometry`; if the robot does drive so, set `odometry_velocity: "
        f"body` or `differentiated` in the robot manifest."
    )


def _steps(samples: MotionSamples, piece: list[int]) -> list[tuple[Floats, Floats]]:
    """Steps of a second in the body's frame and in the fixed one, where the robot hardly turns."""
    stamps = samples.stamps_ns[piece]
    edges = np.searchsorted(stamps, np.arange(stamps[0], stamps[-1] + 1, round(_STEP_S * SECOND)))
    turned = samples.yaw
    found = []
    for begin, end in zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True):
        first, last = piece[begin], piece[end]
        middle = (first + last) // 2
        step = samples.position[last] - samples.position[first]
        seconds = float(samples.stamps_ns[last] - samples.stamps_ns[first]) / SECOND
        if np.isnan(step).any():
            body = samples.linear[first : last + 1].mean(axis=0) * seconds
            step, turn = body, abs(float(samples.angular[middle, 2])) * seconds
        else:
            body = step @ samples.rotation[middle]
            turn = abs(float(turned[last] - turned[first]))
        if np.linalg.norm(step) > _SHORTEST_STEP_M and not turn > _SHARPEST_TURN_RAD:
            found.append((body, step))
    return found
