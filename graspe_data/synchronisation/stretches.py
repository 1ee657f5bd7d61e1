"""Where the stamps of a recording begin again: its parts in which time goes on.

A simulation that is restarted, a playback that loops, a clock that is set in mid-run: from there on
stamps say another time. Nothing is paired or interpolated across such a place.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from graspe_data.arrays import Stamps
from graspe_data.synchronisation.tracks import StampTrack

SECOND: Final = 1_000_000_000
PAUSE_BETWEEN_NS: Final = 10 * SECOND
"""Between two stretches whose stamps would overlap, on the axis of the recording."""
_STEP_BACK_S: Final = 0.05
_STEP_BACK_OF_BAG_S: Final = 0.5
_STEP_OF_CLOCK_S: Final = 0.5
_SETTLED: Final = 5
_FEWEST: Final = 3
_FEWEST_OF_BAG: Final = 10
_MOST_RESTARTS: Final = 1000
_AROUND: Final = 20
_MOST: Final = 0.6
"""Of the messages that it takes to catch up with stamps as they were, this share is to follow."""
_ASCENDING: Final = 0.9


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
    return Order(any(_bag_restarts(t.bag_ns[np.argsort(t.order)]).size > 0 for t in tracks))


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
    place, bag = place[turn], track.bag_ns[turn]
    found: set[int] = set()
    if order.by_writing:
        found |= set(_bag_restarts(bag).tolist())
    if track.header_ns is not None:
        header = track.header_ns[turn]
        back = _restarts(header).tolist()
        found |= {k for k in back if found or _stays(header, bag, k)}
        if header.any():
            found |= set(_clock_steps(header, bag).tolist())
    return [(int(place[k - 1]), int(place[k])) for k in sorted(found)]


def _stays(header: Stamps, bag: Stamps, start: int) -> bool:
    """Whether the clock behind header stamps is another from an index on, as after a restart.

    Messages that were late are behind their time too, and those after them are not.
    """
    step = int(header[:start].max()) - int(header[start])
    before = slice(max(0, start - _AROUND), start)
    skew = bag - header
    moved = float(np.median(skew[start : start + _AROUND])) - float(np.median(skew[before]))
    return 2 * moved > step


def _bag_restarts(bag: Stamps) -> Stamps:
    """The indices at which bag times in the order of writing go back and go on from there.

    Recorders write messages up to half a second out of order.
    """
    return _restarts(bag, _STEP_BACK_OF_BAG_S, _FEWEST_OF_BAG, _FEWEST_OF_BAG)


def _restarts(
    stamps: Stamps,
    step_back_s: float = _STEP_BACK_S,
    fewest: int = _FEWEST,
    fewest_at_all: int = 1,
) -> Stamps:
    """The indices at which stamps (N,) go back and go on from there.

    Messages that come late, one by one or in a burst that fills a hole, are no restart; nor are
    those of a file that is written in no strict order; nor are parts stored out of order that do
    not overlap in time.
    """
    if stamps.size < fewest:
        return np.empty(0, np.int64)
    step, remaining = round(step_back_s * SECOND), np.arange(stamps.size, 0, -1)
    # Where stamps fall far below the highest so far, a stretch may begin.
    highest = np.maximum.accumulate(stamps)
    low = np.concatenate([[False], stamps[1:] - highest[:-1] < -step])
    starts = np.flatnonzero(low & (np.diff(stamps, prepend=stamps[0]) < -step))
    # It has to last: until stamps catch up, or as long as a jump back of that size would take.
    usual = max(1.0, float(np.median(np.abs(np.diff(stamps)))))
    expected = np.maximum(fewest, _MOST * (highest[starts - 1] - step - stamps[starts]) / usual)
    caught_up = np.append(np.flatnonzero(~low), stamps.size)
    stops = caught_up[np.searchsorted(caught_up, starts)]
    long_enough = stops - starts >= np.minimum(expected, remaining[starts])
    # And its stamps rise, as those of a clock that runs do.
    rising = np.concatenate([[0], np.cumsum(np.diff(stamps) >= 0)])
    rises = rising[stops - 1] - rising[starts] >= _ASCENDING * (stops - starts - 1)
    chosen = np.flatnonzero(long_enough & rises & (stops - starts >= fewest_at_all))
    found = [
        int(starts[k])
        for k in chosen[:_MOST_RESTARTS].tolist()
        if _was_there(stamps[: starts[k]], stamps[starts[k] : stops[k]]) or stops[k] == stamps.size
    ]
    return np.array(found, np.int64)


def _was_there(before: Stamps, back: Stamps) -> bool:
    """Whether stamps behind a step back are over times that were there before."""
    return bool(((before >= back[0]) & (before <= back.max())).any())


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
