"""What velocities and poses are taken from, and the words for it."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Final

import numpy as np

from graspe_data.errors import RecordingError
from graspe_data.robot import Robot
from graspe_data.synchronisation.findings import Finding
from graspe_data.synchronisation.motion_agreement import (
    AGREES,
    TURNS_AGREE,
    MotionEvidence,
    PoseSource,
    VelocitySource,
)

_CLEARLY: Final = 0.5
"""One frame explains a twist better than the other if its error is less than half as large."""
_NOTHING_M: Final = 1e-6
_NEAR: Final = 0.1
_ASTRAY: Final = 0.05
"""An error of less than this share of the way tells no frame from another."""


@dataclass(frozen=True)
class MotionChoice:
    """Where velocities and poses come from, and what was found on the way."""

    velocity: VelocitySource
    poses: PoseSource = "reported"
    findings: tuple[Finding, ...] = field(default=())


def choose_motion(evidence: MotionEvidence, robot: Robot, topic: str) -> MotionChoice:
    """Decide by the evidence, or by the manifest where it forces a choice.

    Raises:
        RecordingError: Twist and poses contradict each other, and nothing known explains it.
    """
    forced = robot.odometry_velocity
    free = forced == "checked"
    choice = _at_times(_choose(evidence, topic), evidence, topic) if free else None
    choice = choice or _forced(evidence, robot, topic)
    refusals = [finding for finding in choice.findings if finding.course == "refused"]
    if refusals:
        raise RecordingError(refusals[0].text)
    return choice


def _choose(evidence: MotionEvidence, topic: str) -> MotionChoice:
    if not evidence.has_pose:
        text = f"{topic} has no poses: they are integrated from its twist"
        return _mended("no_poses", topic, text, evidence, "body", "integrated")
    if not evidence.has_twist:
        text = f"{topic} has no twist: velocities are taken from the poses"
        return _mended("no_twist", topic, text, evidence, "differentiated")
    if not evidence.telling and not evidence.turning:
        text = f"{_ways(evidence)}: too little motion to tell the frame of the twist"
        return _choice("little_motion", "noted", topic, text, evidence, "body")
    return _compared(evidence, topic)


def _compared(evidence: MotionEvidence, topic: str) -> MotionChoice:
    body = evidence.share(evidence.body_error_m)
    fixed = evidence.share(evidence.fixed_error_m)
    turns = not evidence.turning or evidence.turn_share <= TURNS_AGREE
    by_twist, by_poses = evidence.told_m, evidence.posed_m
    in_fixed = fixed <= AGREES and fixed < _CLEARLY * body and body > _ASTRAY
    if (not evidence.telling or (body <= AGREES and not in_fixed)) and turns:
        text = f"{_ways(evidence)}: they agree, the twist is the body's"
        return _choice("motion_agrees", "agrees", topic, text, evidence, "body")
    if evidence.pose_constant or (
        evidence.heading_constant and evidence.told_rad > evidence.posed_rad
    ):
        what = "poses were" if evidence.pose_constant else "heading of the poses was"
        text = (
            f"{_ways(evidence)}: the {what} never filled; poses will be integrated from the twist"
        )
        return _mended("poses_never_filled", topic, text, evidence, "body", "integrated")
    if evidence.telling and evidence.twist_constant and by_twist < _NOTHING_M and body > AGREES:
        text = f"{_ways(evidence)}: the twist is empty; velocities will be taken from the poses"
        return _mended("twist_never_filled", topic, text, evidence, "differentiated")
    if evidence.telling and in_fixed and turns:
        text = (
            f"{_ways(evidence)}; {_astray(evidence)}: it is given in the odometry frame and will "
            f"be turned into the body's"
        )
        return _mended("twist_in_fixed_frame", topic, text, evidence, "fixed")
    if not turns and evidence.turn_constant and evidence.told_rad < _NOTHING_M:
        text = f"{_turns(evidence)}: the yaw rate is empty; velocities will be taken from the poses"
        return _mended("yaw_rate_never_filled", topic, text, evidence, "differentiated")
    return _contradiction(evidence, topic, by_twist, by_poses, turns=turns)


def _at_times(choice: MotionChoice, evidence: MotionEvidence, topic: str) -> MotionChoice:
    """The choice, where twist and poses agree on the whole and not all the time."""
    agree = choice.velocity != "differentiated" and choice.poses == "reported"
    if not agree or not evidence.apart or not evidence.has_pose:
        return choice
    begin = f"{evidence.apart} of {evidence.windows} windows with motion, first at"
    begin = f"{topic}: in {begin} {evidence.first_apart_ns} ns, twist and poses are half apart"
    numbers = {"apart": float(evidence.apart), "windows": float(evidence.windows)}
    if evidence.silent:
        text = f"{begin}: the twist stands still there; velocities will be taken from the poses"
        finding = Finding("twist_stops", "mended", topic, text, numbers)
        return MotionChoice("differentiated", "reported", (*choice.findings, finding))
    text = f"{begin}: wheels that slip, or poses that do not follow; the twist counts"
    finding = Finding("motion_differs_at_times", "noted", topic, text, numbers)
    return MotionChoice(choice.velocity, choice.poses, (*choice.findings, finding))


def _contradiction(
    evidence: MotionEvidence, topic: str, by_twist: float, by_poses: float, *, turns: bool
) -> MotionChoice:
    ways = _ways(evidence) if turns else f"{_ways(evidence)}; {_turns(evidence)}"
    ratio = f" ({by_twist / by_poses:.3g} times as far)" if turns and by_poses > 0 else ""
    ratio += _unit(evidence)
    text = (
        f"{topic}: {ways}{ratio}, and no frame explains it: {_astray(evidence)}.{_where(evidence)} "
        f"No rows are made. If you know which of them is right, set `odometry_velocity: body`, "
        f"`fixed` or `differentiated` in the robot manifest."
    )
    return _choice("motion_contradicts", "refused", topic, text, evidence, "body")


def _where(evidence: MotionEvidence) -> str:
    """Where they differ, if it is in less than half of the windows: two causes look the same."""
    if not 0 < 2 * evidence.apart < evidence.windows:
        return ""
    return (
        f" They differ in {evidence.apart} of {evidence.windows} windows with motion, first at "
        f"{evidence.first_apart_ns} ns: either wheels spin there and the poses are right "
        f"(`differentiated`), or the poses do not follow and the twist is right (`body`)."
    )


def _unit(evidence: MotionEvidence) -> str:
    """What unit would explain the ratio between twist and poses."""
    way = evidence.told_m / max(evidence.posed_m, _NOTHING_M)
    turn = evidence.told_rad / max(evidence.posed_rad, _NOTHING_M)
    units = [
        name
        for ratio, factor, name in ((way, 3.6, "km/h"), (turn, 180 / np.pi, "degrees a second"))
        if abs(ratio / factor - 1) < _NEAR
    ]
    return f": it may be in {' and '.join(units)}" if units else ""


def _forced(evidence: MotionEvidence, robot: Robot, topic: str) -> MotionChoice:
    forced = robot.odometry_velocity
    poses: PoseSource = "reported"
    velocity: VelocitySource = "differentiated"
    if forced == "body" or forced == "fixed":  # noqa: PLR1714 - narrows the type
        velocity = forced
        if not evidence.has_pose or (evidence.pose_constant and evidence.telling):
            velocity, poses = "body", "integrated"
    wanted = evidence.has_twist if velocity != "differentiated" else evidence.has_pose
    if not wanted:
        lacks = "twist" if velocity != "differentiated" else "poses"
        raise RecordingError(
            f"{topic}: `odometry_velocity: {forced}` needs {lacks}, which its messages do not have."
        )
    text = f"{_ways(evidence)}; the robot manifest says `odometry_velocity: {forced}`"
    return _choice("velocity_forced", "noted", topic, text, evidence, velocity, poses)


def _mended(
    kind: str,
    topic: str,
    text: str,
    evidence: MotionEvidence,
    velocity: VelocitySource,
    poses: PoseSource = "reported",
) -> MotionChoice:
    return _choice(kind, "mended", topic, text, evidence, velocity, poses)


def _choice(
    kind: str,
    course: str,
    topic: str,
    text: str,
    evidence: MotionEvidence,
    velocity: VelocitySource,
    poses: PoseSource = "reported",
) -> MotionChoice:
    numbers = {
        "twist_m": evidence.told_m,
        "poses_m": evidence.posed_m,
        "body_error_m": evidence.body_error_m,
        "fixed_error_m": evidence.fixed_error_m,
        "twist_rad": evidence.told_rad,
        "poses_rad": evidence.posed_rad,
    }
    finding = Finding(kind, course, topic, text, numbers)  # type: ignore[arg-type]
    return MotionChoice(velocity, poses, (finding,))


def _ways(evidence: MotionEvidence) -> str:
    return f"twist says {evidence.told_m:.1f} m, poses say {evidence.posed_m:.1f} m"


def _astray(evidence: MotionEvidence) -> str:
    return (
        f"taken as the body's, the twist leads {evidence.body_error_m:.1f} m astray, as given in "
        f"the odometry frame {evidence.fixed_error_m:.1f} m"
    )


def _turns(evidence: MotionEvidence) -> str:
    return f"twist turns {evidence.told_rad:.2f} rad, poses turn {evidence.posed_rad:.2f} rad"
