"""Where the stamps of a recording begin again: its parts in which time goes on.

A simulation that is restarted, a playback that loops, a clock that is set in mid-run: from there on
stamps say another time. Nothing is paired or interpolated across such a place.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from graspe_data.synchronisation.tracks import Mask, Stamps, StampTrack

SECOND: Final = 1_000_000_000
PAUSE_BETWEEN_NS: Final = 10 * SECOND
"""Between two stretches whose stamps would overlap, on the axis of the recording."""
_STEP_BACK_S: Final = 0.05
_STEP_OF_CLOCK_S: Final = 0.5
_SETTLED: Final = 5
_FEWEST: Final = 3


@dataclass(frozen=True)
class Order:
    """What tells which of two messages came first, over all topics.

    Bag time, or the order of writing where bag times begin again.
    """

    by_writing: bool

    def of(self, track: StampTrack) -> Stamps:
        """The place of each message of a topic in that order, int64 (N,)."""
        return track.order if self.by_writing else track.bag_ns


def recording_order(tracks: Sequence[StampTrack]) -> Order:
    """The order of a recording's messages."""
    return Order(any(_restarts(t.bag_ns[np.argsort(t.order)]).size > 0 for t in tracks))


def find_cuts(tracks: Sequence[StampTrack], order: Order) -> list[int]:
    """Where stretches begin, on the order's axis, ascending; none for a recording of one stretch.

    Each topic that begins again tells an interval, from its last message before to the first one
    after; intervals that overlap are one event.
    """
    spans = sorted((span for track in tracks for span in _breaks(track, order)), key=_end)
    cuts: list[int] = []
    low = high = 0
    for begin, end in spans:
        if cuts and begin < high:
            low = max(low, begin)
            continue
        low, high = begin, end
        cuts.append(end)
    return cuts


def stretch_of(track: StampTrack, order: Order, cuts: Sequence[int]) -> Stamps:
    """The number of the stretch of each message, from 0, int64 (N,)."""
    return np.searchsorted(np.asarray(cuts, np.int64), order.of(track), side="right")


def _end(span: tuple[int, int]) -> int:
    return span[1]


def _breaks(track: StampTrack, order: Order) -> list[tuple[int, int]]:
    """The places (from, to] on the order's axis at which a topic's time begins again."""
    place = order.of(track)
    turn = np.lexsort((track.order, place))
    place = place[turn]
    stamps = track.bag_ns if track.header_ns is None else track.header_ns
    found = set(_restarts(stamps[turn]).tolist())
    if track.header_ns is not None and track.header_ns.any():
        found |= set(_clock_steps(track.header_ns[turn], track.bag_ns[turn]).tolist())
    if order.by_writing:
        found |= set(_restarts(track.bag_ns[turn]).tolist())
    return [(int(place[k - 1]), int(place[k])) for k in sorted(found)]


def _restarts(stamps: Stamps) -> Stamps:
    """The indices at which stamps (N,) go back and stay back.

    Messages that come late, one by one or in a burst that fills a hole, are no restart; nor are
    parts stored out of order that do not overlap in time.
    """
    if stamps.size < _FEWEST:
        return np.empty(0, np.int64)
    highest = np.maximum.accumulate(stamps)
    low = np.zeros(stamps.size, np.bool_)
    low[1:] = stamps[1:] < highest[:-1] - round(_STEP_BACK_S * SECOND)
    starts = np.flatnonzero(low & (np.diff(stamps, prepend=stamps[0]) < -_STEP_BACK_S * SECOND))
    return np.array([k for k in starts.tolist() if _begins_again(stamps, low, k)], np.int64)


def _begins_again(stamps: Stamps, low: Mask, start: int) -> bool:
    behind = np.flatnonzero(~low[start:])
    stop = start + int(behind[0]) if behind.size else stamps.size
    back, before = stamps[start:stop], stamps[:start]
    if back.size < min(_FEWEST, stamps.size - start):
        return False
    inside = (before >= back[0]) & (before <= back.max())
    return bool(inside.any()) or stamps.size == stop


def _clock_steps(header: Stamps, bag: Stamps) -> Stamps:
    """The indices at which header stamps (N,) leap while bag times go on, and stay where they are.

    A recorder that stalls leaps in bag time alone, which is no step of the sensor's clock.
    """
    limit = round(_STEP_OF_CLOCK_S * SECOND)
    skew = bag - header
    leaps = (np.abs(np.diff(skew)) > limit) & (np.abs(np.diff(bag)) < limit)
    found = []
    for k in np.flatnonzero(leaps).tolist():
        before, after = skew[max(0, k + 1 - _SETTLED) : k + 1], skew[k + 1 : k + 1 + _SETTLED]
        settled = max(np.ptp(before), np.ptp(after)) < limit
        if settled and abs(float(np.median(after) - np.median(before))) > limit:
            found.append(k + 1)
    return np.array(found, np.int64)


def stay_apart(first_ns: Sequence[int], last_ns: Sequence[int]) -> list[int]:
    """What to add to the stamps of each stretch so that none begins before the one before ended.

    Stretches that follow each other anyway keep their stamps.

    Args:
        first_ns: The first stamp of each stretch.
        last_ns: The last one.
    """
    shifts: list[int] = []
    end = None
    for first, last in zip(first_ns, last_ns, strict=True):
        behind = end is not None and first <= end
        shift = end + PAUSE_BETWEEN_NS - first if behind and end is not None else 0
        shifts.append(shift)
        end = last + shift
    return shifts
