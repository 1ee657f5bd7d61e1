"""What a reader yields: topics, raw messages, and what was lost on the way."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple


class RawMessage(NamedTuple):
    """One message as it lies in the recording.

    ``bag_time_ns`` is when the recorder received it; the header stamp is inside ``data``.
    ``position`` rises in the order in which messages were written to the files, whatever the order
    of their times: it tells a clock that began again from messages that were stored out of order.
    """

    topic: str
    bag_time_ns: int
    data: bytes | memoryview
    position: int = 0


@dataclass(frozen=True)
class TopicInfo:
    """A topic, its message type as ``package/msg/Name``, and its encoding on the wire.

    ``count`` is what the recording's own index says; None where there is no index.
    """

    name: str
    message_type: str
    encoding: str
    """``ros1``, ``cdr``, ``json`` or ``protobuf``; others are listed and not decoded."""
    count: int | None = None


@dataclass(frozen=True)
class Damage:
    """Something that a damaged recording no longer yields.

    ``topic`` is None where the damage cannot be told apart by topic. ``messages`` and ``seconds``
    are None where nothing in the recording says how many or how long; ``reason`` names the file,
    the place and the fault.
    """

    reason: str
    topic: str | None = None
    messages: int | None = None
    seconds: float | None = None
