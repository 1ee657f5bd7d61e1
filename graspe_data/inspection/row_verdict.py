"""Whether a recording can make rows, and if not, why."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from graspe_data.errors import GeometryError, RecordingError
from graspe_data.geometry import FrameTree, Transform
from graspe_data.inspection.roles import Role
from graspe_data.inspection.survey import Survey, fixed_edges
from graspe_data.inspection.topic_choice import TopicChoice, declared_topics, guessed_topics
from graspe_data.robot import Clocks, Robot
from graspe_data.synchronisation.clocks import (
    SECOND,
    ClockSettings,
    Timeline,
    camera_timeline,
    timeline,
)
from graspe_data.synchronisation.row_plan import SynchronisationSettings, pair_nearest
from graspe_data.synchronisation.tracks import StampTrack

NEEDED: tuple[Role, ...] = ("image", "points", "odometry")


@dataclass(frozen=True)
class Verdict:
    """Whether rows can be made of ``topics``, the reasons why not, and what must be seen to."""

    possible: bool
    topics: Mapping[Role, str]
    reasons: tuple[str, ...]
    notes: tuple[str, ...]


def row_verdict(survey: Survey, robot: Robot | None = None) -> Verdict:
    """Judge a recording by a robot manifest, or by the likeliest topics where there is none.

    The clocks are held to the rules of synchronisation, with its default limits.
    """
    choice = guessed_topics(survey) if robot is None else declared_topics(robot)
    topics = {role: choice.topics[role] for role in choice.topics}
    if not any(topic.count for topic in survey.topics.values()):
        return Verdict(False, topics, ("no messages",), ())
    reasons = _missing(survey, choice)
    if reasons:
        return Verdict(False, topics, tuple(reasons), ())
    tracks = {role: chosen_track(survey, choice, role) for role in NEEDED}
    clocks = Clocks() if robot is None else robot.clocks
    try:
        times = _on_one_clock(tracks, clocks)
    except RecordingError as error:
        return Verdict(False, topics, (str(error),), ())
    reasons = _unpaired(times)
    notes = [*_calibration_notes(survey, choice, robot), *_length_notes(times)]
    return Verdict(not reasons, topics, tuple(reasons), tuple(notes))


def chosen_track(survey: Survey, choice: TopicChoice, role: Role) -> StampTrack:
    """The stamps of the topic chosen for a role; of odometry by tf, those of its edge."""
    topic = survey.topics[choice.topics[role]]
    if role == "odometry" and "tf" in topic.roles:
        edge = (choice.odometry_frame, choice.base_frame)
        return survey.moving.get(edge, topic.stamps)
    return topic.stamps


def _missing(survey: Survey, choice: TopicChoice) -> list[str]:
    reasons = []
    for role in NEEDED:
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


def _on_one_clock(tracks: Mapping[Role, StampTrack], clocks: Clocks) -> dict[Role, Timeline]:
    camera, limits = tracks["image"], ClockSettings()
    image = camera_timeline(camera, clocks.image)
    return {
        "image": image,
        "points": timeline(tracks["points"], clocks.points, camera, image, limits),
        "odometry": timeline(tracks["odometry"], clocks.odometry, camera, image, limits),
    }


def _unpaired(times: Mapping[Role, Timeline]) -> list[str]:
    settings, image = SynchronisationSettings(), times["image"].stamps_ns
    near = pair_nearest(image, times["points"].stamps_ns, settings.points_tolerance_s) >= 0
    odometry = times["odometry"].stamps_ns
    covered = (image >= odometry.min()) & (image <= odometry.max())
    reasons = []
    if not near.any():
        tolerance = settings.points_tolerance_s
        reasons.append(f"no image has a cloud within {tolerance} s of its stamp")
    if not covered.any():
        reasons.append("no image is stamped while there is odometry")
    if not reasons and not (near & covered).any():
        reasons.append("no image has both a cloud and odometry")
    return reasons


def _length_notes(times: Mapping[Role, Timeline]) -> list[str]:
    settings = SynchronisationSettings()
    history = (settings.history_steps - 1) * settings.history_step_s
    odometry, image = times["odometry"].stamps_ns, times["image"].stamps_ns
    first = odometry.min() + round(history * SECOND)
    last = odometry.max() - round(settings.horizon_s * SECOND)
    anchors = int(np.count_nonzero((image >= first) & (image <= last)))
    if anchors:
        return []
    lasts = (int(odometry.max()) - int(odometry.min())) / SECOND
    spans = f"history of {history:.1f} s and horizon of {settings.horizon_s:.1f} s"
    return [f"the default {spans} leave no row of {lasts:.1f} s: set shorter ones in the dataset"]


def _calibration_notes(survey: Survey, choice: TopicChoice, robot: Robot | None) -> list[str]:
    notes = []
    info = survey.topics.get(choice.topics.get("camera_info", ""))
    if robot is None or robot.camera.intrinsics == "camera_info":
        if info is None or not info.count:
            notes.append("no camera_info: give `camera.intrinsics` in the robot manifest")
        elif info.content is None:
            notes.append(f"no calibration: {info.fault}")
    for role, part in (("image", "camera"), ("points", "lidar")):
        declared = None if robot is None else getattr(robot, part)
        if declared is not None and declared.mounting != "tf":
            continue
        own = survey.topics[choice.topics["image" if role == "image" else "points"]].frame
        frame = own if declared is None else declared.frame or own
        if mounting(survey, choice.base_frame, frame) is None:
            notes.append(
                f"no tf_static from {choice.base_frame!r} to the {part}'s frame {frame!r}: give "
                f"`{part}.mounting` in the robot manifest"
            )
    return notes


def mounting(survey: Survey, base_frame: str, frame: str) -> Transform | None:
    """The transform from a sensor's frame to the base by the static tf, None without one."""
    try:
        edges = {
            (edge.parent, edge.child): Transform.from_quaternion(
                np.array(edge.translation), np.array(edge.quaternion)
            )
            for edge in fixed_edges(survey).edges
        }
        return FrameTree(edges).lookup(base_frame, frame)
    except GeometryError:
        return None
