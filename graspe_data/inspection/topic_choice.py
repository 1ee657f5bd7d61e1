"""Which topics serve a row: those of a robot manifest, or the likeliest by how they run."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np

from graspe_data.geometry import plain_frame
from graspe_data.inspection.roles import Role, likeliest
from graspe_data.inspection.several_robots import own_topics
from graspe_data.inspection.survey import Survey, TopicSurvey
from graspe_data.inspection.topic_content import MotionContent
from graspe_data.robot import Robot
from graspe_data.synchronisation.tracks import StampTrack

Edge = tuple[str, str]

NEEDED: Final[tuple[Role, ...]] = ("image", "points", "odometry")
_OPTIONAL: Final[tuple[Role, ...]] = ("camera_info", "command", "imu")
_LONGEST_INTERVAL_S: Final = 0.25
"""Nine of ten intervals of an odometry are shorter: rows interpolate no further."""
_COVERED: Final = 0.5


@dataclass(frozen=True)
class TopicChoice:
    """Topics by role, and the odometry's frames: ``odometry_frame`` holds ``base_frame``."""

    topics: Mapping[Role, str]
    odometry_frame: str
    base_frame: str


def declared_topics(robot: Robot) -> TopicChoice:
    """The topics that a robot manifest names."""
    declared: dict[Role, str | None] = {
        "image": robot.topics.image,
        "points": robot.topics.points,
        "odometry": None if robot.by_lidar else robot.topics.odometry,
        "camera_info": robot.topics.camera_info,
        "command": robot.topics.command,
        "imu": robot.topics.imu,
    }
    topics = {role: topic for role, topic in declared.items() if topic}
    return TopicChoice(topics, robot.odometry_frame, robot.base_frame)


def guessed_topics(survey: Survey) -> TopicChoice:
    """The likeliest topic for each role; the odometry is a tf topic where nothing else tells it.

    An odometry comes at a rate, while pictures come, and moves if anything does: a goal or a
    localisation that speaks now and then is none. Of several robots in one recording one is taken.
    """
    serving = {role: _decoding(survey, role) for role in (*NEEDED, *_OPTIONAL)}
    serving["odometry"] = _running(survey, serving["odometry"], serving["image"])
    own = own_topics({role: set(serving[role]) for role in serving})
    topics: dict[Role, str] = {}
    for role in (*NEEDED, *_OPTIONAL):
        candidates = {
            name: (topic.info.message_type, topic.count)
            for name, topic in serving[role].items()
            if name in own[role]
        }
        beside = topics.get("image") if role == "camera_info" else None
        if chosen := likeliest(role, candidates, beside):
            topics[role] = chosen
    return _with_frames(survey, topics)


def _with_frames(survey: Survey, topics: dict[Role, str]) -> TopicChoice:
    if "odometry" in topics:
        return TopicChoice(topics, *_odometry_frames(survey.topics[topics["odometry"]]))
    edges = odometry_edges(survey)
    if edges:
        topics["odometry"] = likeliest("tf", _counts(survey.serving("tf"))) or ""
        return TopicChoice(topics, *max(edges, key=lambda edge: edges[edge].bag_ns.size))
    return TopicChoice(topics, "odom", "base_link")


def odometry_edges(survey: Survey) -> dict[Edge, StampTrack]:
    """The moving edges of tf that could be odometry.

    Those to a frame named ``base...``; without such, those whose parent moves in no other frame.
    """
    children = {child for _, child in survey.moving}
    bases = {e: t for e, t in survey.moving.items() if e[1].rpartition("/")[2].startswith("base")}
    return bases or {e: t for e, t in survey.moving.items() if e[0] not in children}


def _decoding(survey: Survey, role: Role) -> dict[str, TopicSurvey]:
    serving = survey.serving(role)
    return {n: t for n, t in serving.items() if t.undecodable < t.count} or serving


def _running(
    survey: Survey, candidates: Mapping[str, TopicSurvey], images: Mapping[str, TopicSurvey]
) -> dict[str, TopicSurvey]:
    """The candidates that run as an odometry does; of these the ones that move, if any does."""
    pictures = [topic.stamps.bag_ns for topic in images.values()]
    span = np.concatenate(pictures) if pictures else np.empty(0, np.int64)
    running = {name: topic for name, topic in candidates.items() if _runs(topic, span)}
    if not running and not survey.moving:
        running = dict(candidates)
    full = {n: t for n, t in running.items() if t.info.message_type.endswith("Odometry")}
    moving = {name: topic for name, topic in (full or running).items() if _moves(topic)}
    return moving or full or running


def _runs(topic: TopicSurvey, pictures_ns: np.ndarray[tuple[int], np.dtype[np.int64]]) -> bool:
    own = np.sort(topic.stamps.bag_ns)
    if own.size < 3:  # noqa: PLR2004 - no rate
        return False
    steady = float(np.percentile(np.diff(own), 90)) <= _LONGEST_INTERVAL_S * 1e9
    if not pictures_ns.size:
        return steady
    inside = (pictures_ns >= own[0]) & (pictures_ns <= own[-1])
    return steady and float(np.mean(inside)) >= _COVERED


def _moves(topic: TopicSurvey) -> bool:
    content = topic.content
    if not isinstance(content, MotionContent):
        return False
    speeds = content.linear_velocity or (0.0, 0.0)
    return bool(content.distance_m) or any(speeds)


def _counts(serving: Mapping[str, TopicSurvey]) -> dict[str, tuple[str, int]]:
    return {name: (topic.info.message_type, topic.count) for name, topic in serving.items()}


def _odometry_frames(topic: TopicSurvey) -> tuple[str, str]:
    child = topic.content.child_frame if isinstance(topic.content, MotionContent) else ""
    return plain_frame(topic.frame) or "odom", plain_frame(child) or "base_link"
