"""A failure of the robot in time."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

EventKind = Literal["stuck", "collision", "oscillation", "stumble", "other"]


@dataclass(frozen=True)
class Event:
    """A failure over the closed interval from ``start_ns`` to ``stop_ns``.

    ``evidence`` says in words and numbers why a rule proposed it, or holds a person's note.
    """

    kind: EventKind
    start_ns: int
    stop_ns: int
    evidence: str = ""

    def meets(self, others: Iterable[Event]) -> bool:
        """Whether it shares an instant with another event of its kind."""
        return any(
            self.kind == other.kind
            and self.start_ns <= other.stop_ns
            and other.start_ns <= self.stop_ns
            for other in others
        )


def bounds_ns(events: Sequence[Event]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """The starts and the stops of events, each int64 (E,)."""
    starts = np.array([event.start_ns for event in events], np.int64)
    return starts, np.array([event.stop_ns for event in events], np.int64)
