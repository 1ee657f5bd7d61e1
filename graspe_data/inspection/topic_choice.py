"""Which topics serve a row: those of a robot manifest, or the likeliest."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from graspe_data.geometry import plain_frame
from graspe_data.inspection.roles import Role, likeliest
from graspe_data.inspection.survey import Survey, TopicSurvey
from graspe_data.inspection.topic_content import MotionContent
from graspe_data.robot import Robot
from graspe_data.synchronisation.tracks import StampTrack

Edge = tuple[str, str]


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
        "odometry": robot.topics.odometry,
        "camera_info": robot.topics.camera_info,
        "command": robot.topics.command,
        "imu": robot.topics.imu,
    }
    topics = {role: topic for role, topic in declared.items() if topic}
    return TopicChoice(topics, robot.odometry_frame, robot.base_frame)


def guessed_topics(survey: Survey) -> TopicChoice:
    """The likeliest topic for each role; the odometry is a tf topic where nothing else tells it."""
    topics: dict[Role, str] = {}
    roles: tuple[Role, ...] = ("image", "points", "odometry", "camera_info", "command", "imu")
    for role in roles:
        serving = survey.serving(role)
        decoding = {n: t for n, t in serving.items() if t.undecodable < t.count} or serving
        candidates = {n: (t.info.message_type, t.count) for n, t in decoding.items()}
        beside = topics.get("image") if role == "camera_info" else None
        if chosen := likeliest(role, candidates, beside):
            topics[role] = chosen
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


def _counts(serving: Mapping[str, TopicSurvey]) -> dict[str, tuple[str, int]]:
    return {name: (topic.info.message_type, topic.count) for name, topic in serving.items()}


def _odometry_frames(topic: TopicSurvey) -> tuple[str, str]:
    child = topic.content.child_frame if isinstance(topic.content, MotionContent) else ""
    return plain_frame(topic.frame) or "odom", plain_frame(child) or "base_link"
