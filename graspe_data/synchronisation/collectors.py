"""Growing arrays of one pass: some tens of bytes a message, whatever its size."""

from __future__ import annotations

from array import array
from dataclasses import dataclass, field
from typing import Final, TypeVar

import numpy as np
from numpy.typing import NDArray

from graspe_data.arrays import Floats
from graspe_data.recordings.messages import RawMessage
from graspe_data.sensor_data import StampedTransform
from graspe_data.synchronisation.tracks import EdgeTrack, StampTrack

Number = TypeVar("Number", int, float)
Scalar = TypeVar("Scalar", np.int64, np.float64)
_THIN_NS: Final = 100_000_000


@dataclass
class Collector:
    """The stamps of one topic, and a row of numbers a message."""

    width: int = 0
    header: array[int] = field(default_factory=lambda: array("q"))
    bag: array[int] = field(default_factory=lambda: array("q"))
    ordinal: array[int] = field(default_factory=lambda: array("q"))
    written: array[int] = field(default_factory=lambda: array("q"))
    values: array[float] = field(default_factory=lambda: array("d"))
    headless: bool = False
    seen: int = 0

    def add(self, stamp_ns: int | None, raw: RawMessage, *values: float) -> None:
        """Take one message; ``seen`` counts the topic's messages, this one included."""
        self.headless |= stamp_ns is None
        self.header.append(stamp_ns or 0)
        self.bag.append(raw.bag_time_ns)
        self.ordinal.append(self.seen - 1)
        self.written.append(raw.position)
        self.values.extend(values)

    def replace_last(self, stamp_ns: int | None, raw: RawMessage, *values: float) -> None:
        """Put a message in the place of the last one."""
        for column in (self.header, self.bag, self.ordinal, self.written):
            column.pop()
        del self.values[len(self.values) - self.width :]
        self.add(stamp_ns, raw, *values)

    def stamps(self, topic: str) -> StampTrack:
        """The stamps, once all messages were taken: views of what was collected."""
        header = None if self.headless else _view(self.header, np.int64)
        bag, ordinal = _view(self.bag, np.int64), _view(self.ordinal, np.int64)
        return StampTrack(topic, header, bag, ordinal, _view(self.written, np.int64))

    def table(self) -> Floats:
        """The rows of numbers, float64 (N, width), once all messages were taken: a view."""
        return _view(self.values, np.float64).reshape(-1, self.width)


def _view(numbers: array[Number], dtype: type[Scalar]) -> NDArray[Scalar]:
    """What was collected, not copied; nothing can be added while the view lives."""
    return np.frombuffer(numbers, dtype)


class EdgeCollector:
    """The samples of one edge of one tf topic; of equal ones in a row ten a second are kept."""

    def __init__(self, topic: str, edge: StampedTransform, *, latched: bool) -> None:
        """Begin an edge."""
        self.topic, self.parent, self.child = topic, edge.parent, edge.child
        self.latched = latched
        self.changes = 0
        self._samples = Collector(width=7)
        self._last: tuple[float, ...] = ()
        self._kept_ns, self._waits = 0, False

    def add(self, edge: StampedTransform, raw: RawMessage) -> None:
        """Take one sample."""
        pose = (*edge.translation, *edge.quaternion)
        self._samples.seen += 1
        repeated, now = pose == self._last, raw.bag_time_ns
        if repeated and self._waits and 0 <= now - self._kept_ns < _THIN_NS:
            self._samples.replace_last(edge.stamp_ns, raw, *pose)
            return
        if not repeated or self._waits:
            self._kept_ns = now
        self._waits = repeated and not self._waits
        self.changes += not repeated
        self._samples.add(edge.stamp_ns, raw, *pose)
        self._last = pose

    def forget(self) -> None:
        """Drop what was kept: nobody looks along this edge."""
        self._samples = Collector(width=7)
        self._last, self._waits = (), False

    def track(self) -> EdgeTrack:
        """The edge as arrays."""
        table = self._samples.table()
        stamps = self._samples.stamps(self.topic)
        return EdgeTrack(stamps, self.parent, self.child, table[:, :3], table[:, 3:], self.latched)
