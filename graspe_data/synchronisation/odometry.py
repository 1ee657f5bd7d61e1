"""The odometry of a recording: poses and velocities of the base frame, in time order."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from graspe_data.arrays import Floats, Mask
from graspe_data.errors import ObservationError, RecordingError
from graspe_data.geometry import Transform
from graspe_data.observation.odometry_series import PoseSeries, odometry_series
from graspe_data.robot import Robot
from graspe_data.synchronisation.course_agreement import check_course
from graspe_data.synchronisation.findings import Finding
from graspe_data.synchronisation.jump_findings import OFTEN, jump_findings
from graspe_data.synchronisation.levelling import level_finding, levelled, vertical_of
from graspe_data.synchronisation.motion_agreement import weigh_motion
from graspe_data.synchronisation.motion_choice import MotionChoice, choose_motion
from graspe_data.synchronisation.motion_samples import (
    MotionSamples,
    carried_to_base,
    differentiated,
    twist_in_body,
)
from graspe_data.synchronisation.placement import Placement
from graspe_data.synchronisation.tracks import MotionTrack


def child_from_base(
    track: MotionTrack, placement: Placement, findings: list[Finding]
) -> Transform | None:
    """Where the base frame is in the odometry's child frame; None where they are one.

    Frames that nothing connects are taken to be one, which is told.

    Raises:
        RecordingError: The frame moves against the base.
    """
    child, base = track.child_frame, placement.robot.base_frame
    transforms, topic = placement.transforms, track.stamps.topic
    if not child or child == base:
        return None
    if not transforms.connects(child, base):
        text = f"{topic} is of {child!r}, which nothing connects to {base!r}: taken to be the same"
        findings.append(Finding("odometry_of_other_frame", "noted", child, text))
        return None
    if not transforms.is_fixed(child, base):
        raise RecordingError(
            f"{topic}: odometry of {child!r}, which moves against {base!r}. Set `base_frame` to "
            f"the frame that the odometry is of, or name another odometry under `topics.odometry`."
        )
    found = transforms.changes(child, base)[-1][1]
    if np.allclose(found.rotation, np.eye(3)) and np.allclose(found.translation, 0):
        return None
    x, y, z = np.round(found.inverse().translation, 3).tolist()
    text = f"{topic} is of {child!r}, at ({x}, {y}, {z}) m in {base!r}: carried over to {base!r}"
    findings.append(Finding("odometry_carried_to_base", "mended", child, text))
    return found


def build_odometry(
    stretches: Sequence[MotionSamples],
    robot: Robot,
    base: Transform | None,
    findings: list[Finding],
) -> PoseSeries:
    """Decide what velocities and poses are taken from, and take them.

    Args:
        stretches: The motion of the odometry's child frame, a series a stretch, on one time axis,
            cut at its jumps.
        robot: Its limits, and the choice that its manifest may force.
        base: Where the base frame is on that body; None where it is the child frame.
        findings: Is told what was found.

    Raises:
        RecordingError: Twist and poses contradict each other, poses jump to and fro, velocities are
            beyond the robot's limits throughout, or fewer than two samples are usable.
    """
    topic = robot.topics.odometry
    findings += jump_findings(stretches, robot)
    up = vertical_of(stretches, base)
    findings += level_finding(up, topic)
    evidence = weigh_motion(stretches, up)
    choice = choose_motion(evidence, robot, topic)
    findings += choice.findings
    joined = _joined([_with_velocity(samples, choice, base, up) for samples in stretches])
    rests_on_heading = choice.velocity == "differentiated" and evidence.heading_constant
    findings += check_course(joined.samples, robot, heading_constant=rests_on_heading, topic=topic)
    return _within_limits(joined, robot, choice, findings)


@dataclass(frozen=True)
class _Moving:
    """Samples with the velocity of the base, (N, 2): m/s along x and rad/s about z."""

    samples: MotionSamples
    velocity: Floats


def _with_velocity(
    samples: MotionSamples, choice: MotionChoice, child_from_base: Transform | None, up: Floats
) -> _Moving:
    given = twist_in_body(samples) if choice.velocity == "fixed" else samples
    if child_from_base is not None:
        given = carried_to_base(given, child_from_base)
    given = levelled(given, up)
    if choice.velocity == "differentiated":
        return _Moving(given, differentiated(given))
    velocity = np.stack([given.linear[:, 0], given.angular[:, 2]], axis=1)
    if choice.poses == "integrated":
        empty = np.full_like(given.position, np.nan)
        given = replace(given, position=empty, rotation=np.full_like(given.rotation, np.nan))
    return _Moving(given, velocity)


def _joined(stretches: Sequence[_Moving]) -> _Moving:
    """One series of all stretches, whose segments count on."""
    segments, count = [], 0
    for moving in stretches:
        segments.append(moving.samples.segment + count)
        count = int(segments[-1].max(initial=count - 1)) + 1
    parts = [moving.samples for moving in stretches]
    whole = MotionSamples(
        stamps_ns=np.concatenate([part.stamps_ns for part in parts]),
        position=np.concatenate([part.position for part in parts]),
        rotation=np.concatenate([part.rotation for part in parts]),
        linear=np.concatenate([part.linear for part in parts]),
        angular=np.concatenate([part.angular for part in parts]),
        segment=np.concatenate(segments),
    )
    return _Moving(whole, np.concatenate([moving.velocity for moving in stretches]))


def _within_limits(
    moving: _Moving, robot: Robot, choice: MotionChoice, findings: list[Finding]
) -> PoseSeries:
    """The series without samples beyond twice the limits; refused where these are no outliers."""
    topic, samples = robot.topics.odometry, moving.samples
    beyond = _beyond(moving.velocity, robot)
    if beyond.any():
        findings.append(_limit_finding(moving, beyond, robot, choice))
    kept = ~beyond
    try:
        return odometry_series(
            samples.stamps_ns[kept],
            samples.position[kept],
            samples.rotation[kept],
            moving.velocity[kept],
            samples.segment[kept],
        )
    except ObservationError as error:
        raise RecordingError(f"{topic}: {error}") from error


def _beyond(velocity: Floats, robot: Robot) -> Mask:
    fastest = 2 * max(map(abs, robot.limits.linear_velocity))
    quickest = 2 * max(map(abs, robot.limits.yaw_rate))
    with np.errstate(invalid="ignore"):
        beyond = np.abs(velocity) > np.array((fastest, quickest))
    return np.asarray(beyond.any(axis=1))


def _limit_finding(moving: _Moving, beyond: Mask, robot: Robot, choice: MotionChoice) -> Finding:
    topic = robot.topics.odometry
    count, share = int(np.count_nonzero(beyond)), float(np.mean(beyond))
    v, omega = np.nanmax(np.abs(moving.velocity), axis=0).tolist()
    fastest = max(map(abs, robot.limits.linear_velocity))
    quickest = max(map(abs, robot.limits.yaw_rate))
    text = (
        f"{topic}: {count} of {beyond.size} velocities ({choice.velocity}) are beyond twice the "
        f"robot's limits of {fastest:g} m/s and {quickest:g} rad/s, up to {v:.2f} m/s and "
        f"{omega:.2f} rad/s"
    )
    if share > OFTEN:
        raise RecordingError(
            f"{text}. No rows are made. Correct `limits` in the robot manifest, or name another "
            f"odometry."
        )
    numbers = {"beyond": float(count), "linear_velocity": v, "yaw_rate": omega}
    return Finding("beyond_limits", "mended", topic, f"{text}: these samples are left out", numbers)
