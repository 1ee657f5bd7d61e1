"""Which tf topics speak of a robot, and the edges they give while the first pass runs."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterable, Mapping
from math import isfinite
from typing import Final

from graspe_data.geometry import plain_frame
from graspe_data.recordings.messages import RawMessage, TopicInfo
from graspe_data.sensor_data import StampedTransform
from graspe_data.synchronisation.collectors import EdgeCollector
from graspe_data.synchronisation.tracks import EdgeTrack

TF_TYPES: Final = ("tf2_msgs/msg/TFMessage", "tf/msg/tfMessage")
MAXIMUM_EDGES: Final = 4096
_PRUNE_EVERY: Final = 4096
_SHORTEST_QUATERNION: Final = 1e-6


def is_latched(topic: str) -> bool:
    """Whether a tf topic is one of static transforms."""
    return topic.rpartition("/")[2].endswith("static")


def namespace_of(topic: str) -> tuple[str, ...]:
    """The parts of a topic's name before its last."""
    return tuple(part for part in topic.split("/") if part)[:-1]


def transform_topics(topics: Mapping[str, TopicInfo], sensors: Collection[str]) -> list[str]:
    """The tf topics of the robot whose sensor topics are given, the most general first.

    A tf topic speaks of the robot whose namespace it shares: ``/robot1/tf_static`` of
    ``/robot1/camera/image``, ``/tf`` of every robot. Where no tf topic does so and all of the
    recording lie in one namespace, these are taken.
    """
    every = [name for name, info in topics.items() if info.message_type in TF_TYPES]
    own = [name for name in every if any(_within(sensor, name) for sensor in sensors)]
    if not own and len({namespace_of(name) for name in every}) == 1:
        own = every
    return sorted(own, key=lambda name: (len(namespace_of(name)), name))


def _within(sensor: str, tf_topic: str) -> bool:
    space = namespace_of(tf_topic)
    return namespace_of(sensor)[: len(space)] == space


class EdgeReader:
    """Collects the edges of tf; those that lead to no frame of interest keep one sample.

    ``targets`` may grow while the pass runs: the frames of sensors are known once a message came.
    """

    def __init__(self, targets: Iterable[str]) -> None:
        """Begin with the frames that are known to matter."""
        self.targets = {plain_frame(frame) for frame in targets if frame}
        self.unusable: Counter[str] = Counter()
        self._why: dict[str, str] = {}
        self._edges: dict[tuple[str, str, str], EdgeCollector] = {}
        self._messages = 0

    def take(self, raw: RawMessage, edges: Iterable[StampedTransform]) -> None:
        """Take the edges of one message; those that describe no transform are counted apart."""
        self._messages += 1
        for edge in edges:
            parent, child = plain_frame(edge.parent), plain_frame(edge.child)
            if fault := _fault(edge, parent, child):
                self.unusable[f"{parent} -> {child}"] += 1
                self._why.setdefault(f"{parent} -> {child}", fault)
                continue
            key = (raw.topic, parent, child)
            known = self._edges.get(key)
            if known is None:
                if len(self._edges) >= MAXIMUM_EDGES:
                    continue
                named = StampedTransform(0, parent, child, edge.translation, edge.quaternion)
                known = EdgeCollector(raw.topic, named, latched=is_latched(raw.topic))
                self._edges[key] = known
            known.add(edge, raw)
        if self._messages % _PRUNE_EVERY == 0:
            self._prune()

    def tracks(self) -> tuple[EdgeTrack, ...]:
        """The edges that lead to a frame of interest, and what few samples others have."""
        self._prune()
        found = (self._edges[key].track() for key in sorted(self._edges))
        return tuple(track for track in found if track.stamps.bag_ns.size)

    def faults(self) -> tuple[str, ...]:
        """What was skipped, in words."""
        return tuple(
            f"{edge}: {count} of its transforms skipped, {self._why[edge]}"
            for edge, count in sorted(self.unusable.items())
        )

    def _prune(self) -> None:
        """Forget the samples of edges that no path between frames of interest can use."""
        parents: dict[str, set[str]] = {}
        for _, parent, child in self._edges:
            parents.setdefault(child, set()).add(parent)
        wanted, waiting = set(self.targets), list(self.targets)
        while waiting:
            for parent in parents.get(waiting.pop(), ()):
                if parent not in wanted:
                    wanted.add(parent)
                    waiting.append(parent)
        for (_, _, child), edge in self._edges.items():
            if child not in wanted and not edge.latched and edge.changes > 1:
                edge.forget()


def _fault(edge: StampedTransform, parent: str, child: str) -> str | None:
    if not all(map(isfinite, (*edge.translation, *edge.quaternion))):
        return "with numbers that are not finite"
    if sum(value * value for value in edge.quaternion) < _SHORTEST_QUATERNION:
        return "with a quaternion of zero length"
    return "from a frame to itself" if parent == child else None
