"""A stream of recorded messages, and the habits that change how a drive is written."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
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
