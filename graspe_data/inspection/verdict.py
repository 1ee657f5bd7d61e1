"""Whether a recording can make rows, and if not, why: the word of the planner of rows."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from graspe_data.inspection.evidence import Evidence
from graspe_data.inspection.roles import Role
from graspe_data.inspection.several_robots import robot_namespaces
from graspe_data.inspection.topic_choice import NEEDED
from graspe_data.synchronisation.clocks import SECOND
from graspe_data.synchronisation.findings import Finding
from graspe_data.synchronisation.row_plan import SynchronisationSettings


@dataclass(frozen=True)
class Verdict:
    """Whether rows can be made of ``topics``, and how many with the usual windows.

    ``reasons`` say why not; ``findings`` what agrees and what does not, with both numbers;
    ``notes`` what must be seen to.
    """

    possible: bool
    topics: Mapping[Role, str]
    reasons: tuple[str, ...]
    notes: tuple[str, ...]
    rows: int = 0
    findings: tuple[Finding, ...] = ()


def verdict_of(evidence: Evidence) -> Verdict:
    """Judge a recording by its evidence."""
    topics = dict(evidence.choice.topics)
    if not any(topic.count for topic in evidence.survey.topics.values()):
        return Verdict(False, topics, ("no messages",), ())
    reasons = _missing(evidence)
    if not reasons and evidence.fault is not None:
        reasons = [evidence.fault]
    planned = evidence.planned
    if reasons or planned is None:
        return Verdict(False, topics, tuple(reasons), (), 0, evidence.findings)
    rows = planned.plan.rows
    if not rows and not evidence.shortest:
        lost = planned.plan.lost
        why = [f"no row of {sum(lost.values())} pictures: " + _lost(lost)]
        return Verdict(False, topics, tuple(why), (), 0, evidence.findings)
    notes = [
        *_other_robots(evidence),
        *_stand_ins(evidence),
        *([] if rows else _too_short(evidence)),
    ]
    return Verdict(True, topics, (), tuple(notes), rows, evidence.findings)


def _lost(lost: Mapping[str, int]) -> str:
    return "; ".join(f"{count} lost: {reason}" for reason, count in lost.items())


def _missing(evidence: Evidence) -> list[str]:
    reasons = []
    survey, choice = evidence.survey, evidence.choice
    by_lidar = evidence.robot is not None and evidence.robot.by_lidar
    for role in NEEDED[:2] if by_lidar else NEEDED:
        name = choice.topics.get(role)
        topic = survey.topics.get(name or "")
        serves = topic is not None and (
            role in topic.roles or (role == "odometry" and "tf" in topic.roles)
        )
        if name is None:
            reasons.append(f"no topic that could serve as {role}")
        elif topic is None:
            reasons.append(f"no topic {name}, which the robot manifest names as {role}")
        elif not serves:
            reasons.append(f"{name} is {topic.info.message_type}, which cannot serve as {role}")
        elif not topic.count:
            reasons.append(f"no messages on {name}, the {role}")
        elif topic.undecodable >= topic.count or (topic.fault and topic.content is None):
            reasons.append(f"no message on {name} decodes: {topic.fault}")
    return reasons


def _other_robots(evidence: Evidence) -> list[str]:
    serving = {role: set(evidence.survey.serving(role)) for role in NEEDED}
    spaces = ["/" + "/".join(space) for space in robot_namespaces(serving)]
    image = evidence.choice.topics.get("image", "")
    own = next((space for space in spaces if image.startswith(f"{space}/")), "")
    if len(spaces) < 2:  # noqa: PLR2004
        return []
    note = (
        f"the recording holds {len(spaces)} robots, {', '.join(spaces)}: these are the topics of "
        f"{own or 'none of them'}; give each robot a manifest of its own"
    )
    return [note]


def _stand_ins(evidence: Evidence) -> list[str]:
    """What a guessed manifest lacks and its owner must give."""
    robot, tracks = evidence.robot, evidence.tracks
    if robot is None or tracks is None:
        return []
    base, missing = robot.base_frame, evidence.placeholders
    notes = []
    if "camera.intrinsics" in missing:
        fault = _calibration_fault(evidence)
        notes.append(f"{fault}: give `camera.intrinsics` in the robot manifest")
    for part, frame in (("camera", tracks.image_frame), ("lidar", tracks.points_frame)):
        if f"{part}.mounting" in missing:
            notes.append(
                f"no fixed transform from {base!r} to the {part}'s frame {frame!r}: give "
                f"`{part}.mounting` in the robot manifest"
            )
    return notes


def _calibration_fault(evidence: Evidence) -> str:
    info = evidence.survey.topics.get(evidence.choice.topics.get("camera_info", ""))
    if info is None or not info.count:
        return "no camera_info"
    return f"no calibration: {info.fault}"


def _too_short(evidence: Evidence) -> list[str]:
    settings, planned = SynchronisationSettings(), evidence.planned
    if planned is None:
        return []
    stamps = planned.odometry.stamps_ns
    history = (settings.history_steps - 1) * settings.history_step_s
    lasts = (int(stamps[-1]) - int(stamps[0])) / SECOND
    spans = f"history of {history:.1f} s and horizon of {settings.horizon_s:.1f} s"
    return [f"the default {spans} leave no row of {lasts:.1f} s: set shorter ones in the dataset"]
