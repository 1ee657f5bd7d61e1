"""One pass over a recording that looks at every topic: stamps, contents, faults."""

from __future__ import annotations

from array import array
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from graspe_data.errors import RecordingError
from graspe_data.geometry import plain_frame
from graspe_data.inspection.roles import Role, roles_of
from graspe_data.inspection.topic_content import Content
from graspe_data.inspection.topic_observers import MAXIMUM_EDGES, Observer, observer_of
from graspe_data.recordings.decoding import decode_transforms
from graspe_data.recordings.messages import Damage, RawMessage, TopicInfo
from graspe_data.recordings.recording import Recording
from graspe_data.sensor_data import StampedTransform
from graspe_data.synchronisation.tracks import StampTrack

_LATEST = (1 << 63) - 1


@dataclass(frozen=True)
class TopicSurvey:
    """A topic as it was met.

    ``undecodable`` counts messages of a topic with a role that do not decode; of pictures and
    clouds a sample is decoded to the last byte. ``fault`` is the text of the first.
    """

    info: TopicInfo
    roles: tuple[Role, ...]
    stamps: StampTrack
    frame: str
    undecodable: int
    fault: str | None
    content: Content | None

    @property
    def count(self) -> int:
        """Messages that the recording yielded, those that do not decode included."""
        return int(self.stamps.bag_ns.size)


@dataclass(frozen=True)
class Survey:
    """All topics by name, what is lost, and the edges of tf that move, ``(parent, child)``."""

    topics: Mapping[str, TopicSurvey]
    losses: tuple[Damage, ...]
    moving: Mapping[tuple[str, str], StampTrack]

    def serving(self, role: Role) -> dict[str, TopicSurvey]:
        """The topics with messages that could serve a role."""
        return {n: t for n, t in self.topics.items() if role in t.roles and t.count}


def survey_recording(recording: Recording) -> Survey:
    """Read a recording once; a message costs 16 bytes of memory, whatever its size."""
    topics = {name: _Topic(info, recording) for name, info in recording.topics.items()}
    edges: dict[tuple[str, str], _Edge] = {}
    for raw in recording.messages():
        topic = topics[raw.topic]
        topic.stamps.add(recording.header_stamp_ns(raw), raw.bag_time_ns)
        if topic.observer is None:
            continue
        try:
            message = recording.decode(raw)
            topic.observe(message, raw)
            if "tf" in topic.roles:
                _add_edges(edges, message, raw)
        except RecordingError as error:
            topic.undecodable += 1
            topic.fault = topic.fault or str(error)
    moving = {k: e.stamps.track(" -> ".join(k)) for k, e in sorted(edges.items()) if e.moved}
    surveyed = {name: topic.survey() for name, topic in topics.items()}
    return Survey(surveyed, tuple(recording.losses), moving)


@dataclass
class _Stamps:
    header: array[int] = field(default_factory=lambda: array("q"))
    bag: array[int] = field(default_factory=lambda: array("q"))
    stamped: bool = False

    def add(self, header_ns: int | None, bag_ns: int) -> None:
        self.stamped |= header_ns is not None
        self.header.append(header_ns or 0)
        self.bag.append(min(bag_ns, _LATEST))

    def track(self, topic: str) -> StampTrack:
        header = np.array(self.header, np.int64) if self.stamped else None
        return StampTrack(topic, header, np.array(self.bag, np.int64), np.arange(len(self.bag)))


class _Topic:
    """A topic while the pass runs."""

    def __init__(self, info: TopicInfo, recording: Recording) -> None:
        self.info, self.roles = info, roles_of(info.name, info.message_type)
        self.stamps = _Stamps()
        self.frame, self.undecodable = "", 0
        self.fault: str | None = None
        self.observer: Observer | None = None
        if self.roles:
            self.observer = observer_of(self.roles[0], info.name, info.message_type, recording)

    def observe(self, message: Any, raw: RawMessage) -> None:
        header = getattr(message, "header", None)
        self.frame = self.frame or getattr(header or message, "frame_id", "")
        if self.observer is not None:
            self.observer.observe(message, raw)

    def survey(self) -> TopicSurvey:
        return TopicSurvey(
            self.info,
            self.roles,
            self.stamps.track(self.info.name),
            self.frame,
            self.undecodable,
            self.fault,
            self.observer.content() if self.observer and self.stamps.bag else None,
        )


@dataclass
class _Edge:
    """A tf edge: its stamps, and whether it ever differed from its first transform."""

    first: StampedTransform
    stamps: _Stamps = field(default_factory=_Stamps)
    moved: bool = False

    def add(self, edge: StampedTransform, bag_ns: int) -> None:
        self.stamps.add(edge.stamp_ns, bag_ns)
        here, there = edge, self.first
        self.moved |= (here.translation, here.quaternion) != (there.translation, there.quaternion)


def _add_edges(edges: dict[tuple[str, str], _Edge], message: Any, raw: RawMessage) -> None:
    for edge in decode_transforms(message):
        key = (plain_frame(edge.parent), plain_frame(edge.child))
        if key in edges or len(edges) < MAXIMUM_EDGES:
            edges.setdefault(key, _Edge(edge)).add(edge, raw.bag_time_ns)
