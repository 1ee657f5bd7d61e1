"""A stream of recorded messages, and the habits that change how a drive is written."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any


@dataclass(frozen=True)
class Recorded:
    """A message as it reaches the recorder; bag time in ns."""

    topic: str
    content: Any
    bag_time_ns: int


Habit = Callable[[Iterable[Recorded]], Iterator[Recorded]]
"""Takes a stream and gives another that tells the same drive."""


def with_habits(stream: Iterable[Recorded], habits: Sequence[Habit]) -> Iterator[Recorded]:
    """A stream under habits, the first applied first."""
    for habit in habits:
        stream = habit(stream)
    return iter(stream)


def changed(topic: str, change: Callable[[Any], Any]) -> Habit:
    """Each message of a topic becomes another; the rest pass."""

    def habit(stream: Iterable[Recorded]) -> Iterator[Recorded]:
        for message in stream:
            mine = message.topic == topic
            yield replace(message, content=change(message.content)) if mine else message

    return habit


def left_out(topic: str) -> Habit:
    """A topic that nobody recorded."""

    def habit(stream: Iterable[Recorded]) -> Iterator[Recorded]:
        return (message for message in stream if message.topic != topic)

    return habit


def topics_renamed(names: Mapping[str, str]) -> Habit:
    """Topics under other names; those that are not named keep theirs."""

    def habit(stream: Iterable[Recorded]) -> Iterator[Recorded]:
        for message in stream:
            yield replace(message, topic=names.get(message.topic, message.topic))

    return habit


def frames_renamed(names: Mapping[str, str]) -> Habit:
    """Frames under other names, in headers, odometry and tf."""

    def habit(stream: Iterable[Recorded]) -> Iterator[Recorded]:
        for message in stream:
            yield replace(message, content=_renamed(message.content, names))

    return habit


def _renamed(content: Any, names: Mapping[str, str]) -> Any:
    new: dict[str, Any] = {}
    if hasattr(content, "header"):
        frame = content.header.frame_id
        new["header"] = replace(content.header, frame_id=names.get(frame, frame))
    if hasattr(content, "child_frame_id"):
        new["child_frame_id"] = names.get(content.child_frame_id, content.child_frame_id)
    if hasattr(content, "transforms"):
        new["transforms"] = [_renamed(stamped, names) for stamped in content.transforms]
    return replace(content, **new) if new else content
