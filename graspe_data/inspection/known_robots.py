"""Which of the robots that ship as manifests a recording could be of."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from functools import cache
from typing import Final

from graspe_data.geometry import plain_frame
from graspe_data.inspection.survey import Survey
from graspe_data.inspection.topic_content import FramesContent, MotionContent
from graspe_data.manifest import load_manifest, shipped_manifests
from graspe_data.recordings.message_types import normalise_type
from graspe_data.robot import Recognition, Robot

LEAST_SHARE: Final = 0.6
"""A robot of whose topics fewer are found is not suggested."""


def suggest(topics: Mapping[str, str], frames: Collection[str]) -> list[tuple[str, float]]:
    """The shipped robots that fit a recording, the best first.

    A topic counts under any namespace, if its type is right. Of robots with the same share, the
    one with more topics found goes first, then the one whose names match without a namespace.

    Args:
        topics: Every topic with its message type, however spelt.
        frames: Those in headers, in odometry and in tf; none given, none is asked for.

    Returns:
        Names of manifests, and the share of their topics that was found, 0 to 1.
    """
    found = {name: normalise_type(kind) for name, kind in topics.items()}
    known = {_last_part(frame) for frame in frames}
    ranked = []
    for name, recognition in _recognitions().items():
        if known and not set(recognition.frames) <= known:
            continue
        share, count, exact = _score(recognition, found)
        if share >= LEAST_SHARE:
            ranked.append((-share, -count, -exact, name))
    return [(name, -share) for share, _, _, name in sorted(ranked)]


def suggested_robots(survey: Survey) -> tuple[tuple[str, float], ...]:
    """The shipped robots that fit what was seen of a recording, the best first."""
    topics = {name: topic.info.message_type for name, topic in survey.topics.items() if topic.count}
    frames = {topic.frame for topic in survey.topics.values()}
    for topic in survey.topics.values():
        if isinstance(topic.content, MotionContent):
            frames.add(topic.content.child_frame)
        elif isinstance(topic.content, FramesContent):
            frames |= {end for edge in topic.content.edges for end in (edge.parent, edge.child)}
    return tuple(suggest(topics, frames - {""}))


def _score(recognition: Recognition, found: Mapping[str, str]) -> tuple[float, int, int]:
    """Share and number of a robot's topics that are found, and how many under their very name."""
    matches = [
        [name for name in found if _is_topic(name, found[name], wanted, kind)]
        for wanted, kind in recognition.topics.items()
    ]
    count = sum(1 for names in matches if names)
    exact = sum(1 for wanted in recognition.topics if wanted in found)
    return count / len(matches), count, exact


def _is_topic(name: str, kind: str, wanted: str, wanted_kind: str) -> bool:
    named = name == wanted or name.endswith(wanted)
    return named and (not wanted_kind or kind == normalise_type(wanted_kind))


def _last_part(frame: str) -> str:
    return plain_frame(frame).rpartition("/")[2]


@cache
def _recognitions() -> dict[str, Recognition]:
    folder = shipped_manifests() / "robots"
    robots = [load_manifest(path, Robot) for path in sorted(folder.glob("*.yaml"))]
    return {robot.name: robot.recognised_by or _by_topics(robot) for robot in robots}


def _by_topics(robot: Robot) -> Recognition:
    """A robot that says nothing else is known by the topics that it names."""
    topics = {topic: "" for _, topic in robot.topics if topic}
    return Recognition.model_construct(topics=topics, frames=())
