"""Failures of the robot in time, and the runs and intervals that they are made of."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from graspe_data.arrays import Mask, Stamps

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


Indices = NDArray[np.intp]


def true_runs(mask: Mask, stamps_ns: Stamps, maximum_gap_ns: int) -> tuple[Indices, Indices]:
    """First and last index of every run of true samples; a gap in time ends a run.

    Args:
        mask: bool (N,).
        stamps_ns: int64 (N,), increasing.
        maximum_gap_ns: Neighbouring samples further apart than this belong to different runs.

    Returns:
        Two arrays intp (R,) of indices into the samples, both included, in order.
    """
    joined = mask[1:] & mask[:-1] & (np.diff(stamps_ns) <= maximum_gap_ns)
    edge = np.zeros(min(1, mask.size), np.bool_)
    first = mask & ~np.concatenate([edge, joined])
    last = mask & ~np.concatenate([joined, edge])
    return np.flatnonzero(first), np.flatnonzero(last)


def join_intervals(starts: Stamps, stops: Stamps, join_ns: int) -> tuple[Stamps, Stamps]:
    """Disjoint intervals in order; those that overlap or lie within ``join_ns`` become one."""
    order = np.argsort(starts, kind="stable")
    starts, reach = starts[order], np.maximum.accumulate(stops[order])
    fresh = np.ones(starts.size, np.bool_)
    fresh[1:] = starts[1:] > reach[:-1] + join_ns
    return starts[fresh], reach[np.roll(fresh, -1)]


def touches(starts: Stamps, stops: Stamps, after: Stamps, until: Stamps) -> Mask:
    """Whether any closed interval [start, stop] meets each half-open span (after, until].

    Args:
        starts: int64 (E,), in any order.
        stops: int64 (E,), none before its start.
        after: int64, of any shape.
        until: int64, of the same shape.
    """
    if not starts.size:
        return np.zeros(after.shape, np.bool_)
    order = np.argsort(starts, kind="stable")
    reach = np.maximum.accumulate(stops[order])
    begun = np.searchsorted(starts[order], until, side="right")
    met: Mask = (begun > 0) & (reach[np.maximum(begun, 1) - 1] > after)
    return met
