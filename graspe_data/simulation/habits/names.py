"""Other names for topics and frames, and names under a namespace."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from typing import Any

from graspe_data.simulation.habits.recorded import Habit, Recorded


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
