"""How a topic runs in time: rate, gaps, order, and the skew between its stamps and the recorder."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from graspe_data.arrays import Stamps
from graspe_data.synchronisation.clocks import SECOND, skew_ns
from graspe_data.synchronisation.tracks import StampTrack

GAP_INTERVALS: Final = 3.0
SHORTEST_GAP_S: Final = 0.2


@dataclass(frozen=True)
class Gaps:
    """Silences above 0.2 s and three times the median interval.

    ``at_s`` is the recorder's time at which the longest begins, from the recording's first message.
    """

    number: int
    longest_s: float
    at_s: float


@dataclass(frozen=True)
class Skew:
    """Bag time minus header stamp in seconds; negative where the stamps run ahead.

    ``low_s`` and ``high_s`` are the 5th and 95th percentile. ``drift_s`` is what a straight line
    fitted to the skew gains over the recording.
    """

    median_s: float
    low_s: float
    high_s: float
    minimum_s: float
    maximum_s: float
    drift_s: float


@dataclass(frozen=True)
class TopicStatistics:
    """A topic in time.

    Rate, duration and gaps are those of ``clock``: ``header`` where the messages are stamped, else
    ``bag``. The rate in Hz is that of the median interval. ``out_of_order`` counts stamps below
    the latest one before, ``repeated`` stamps equal to the one before.
    """

    clock: str
    duration_s: float
    rate_hz: float | None
    gaps: Gaps | None
    skew: Skew | None
    out_of_order: int
    repeated: int
    zero_stamps: int


def topic_statistics(track: StampTrack, start_ns: int) -> TopicStatistics | None:
    """Describe a topic in time; None where it has no message.

    Args:
        track: The topic's stamps in the reader's order.
        start_ns: Bag time of the recording's first message.
    """
    if not track.bag_ns.size:
        return None
    stamped = _stamped(track)
    own = stamped.header_ns
    clock, stamps = ("bag", track.bag_ns) if own is None else ("header", own)
    bag = track.bag_ns if own is None else stamped.bag_ns
    order = np.argsort(stamps, kind="stable")
    intervals = np.diff(stamps[order]) / SECOND
    typical = float(np.median(intervals[intervals > 0])) if np.any(intervals > 0) else None
    steps = np.diff(stamps)
    zero = 0 if track.header_ns is None else int(np.count_nonzero(track.header_ns == 0))
    return TopicStatistics(
        clock=clock,
        duration_s=float(intervals.sum()),
        rate_hz=None if typical is None else 1.0 / typical,
        gaps=_gaps(stamps[order], (bag[order] - start_ns) / SECOND, typical),
        skew=_skew(stamped),
        out_of_order=int(np.count_nonzero(stamps < np.maximum.accumulate(stamps))),
        repeated=int(np.count_nonzero(steps == 0)),
        zero_stamps=zero,
    )


def _stamped(track: StampTrack) -> StampTrack:
    """The messages whose stamp is set; without header where none is."""
    if track.header_ns is None or not track.header_ns.any():
        return StampTrack(track.topic, None, track.bag_ns, track.ordinal)
    kept = track.header_ns != 0
    return StampTrack(track.topic, track.header_ns[kept], track.bag_ns[kept], track.ordinal[kept])


def _gaps(ordered: Stamps, bag_s: NDArray[np.float64], typical: float | None) -> Gaps | None:
    if typical is None:
        return None
    intervals = np.diff(ordered) / SECOND
    gaps = np.flatnonzero(intervals > max(GAP_INTERVALS * typical, SHORTEST_GAP_S))
    if not gaps.size:
        return None
    longest = int(gaps[intervals[gaps].argmax()])
    return Gaps(gaps.size, float(intervals[longest]), float(bag_s[longest]))


def _skew(track: StampTrack) -> Skew | None:
    if track.header_ns is None:
        return None
    skew = skew_ns(track)
    # Relative to the first, since a float64 of 1.6e18 ns steps by 256 ns.
    first, relative = int(skew[0]), (skew - skew[0]) / SECOND
    low, median, high = (first / SECOND + q for q in np.percentile(relative, (5, 50, 95)).tolist())
    return Skew(
        median_s=median,
        low_s=low,
        high_s=high,
        minimum_s=first / SECOND + float(relative.min()),
        maximum_s=first / SECOND + float(relative.max()),
        drift_s=_drift((track.bag_ns - track.bag_ns[0]) / SECOND, relative),
    )


def _drift(time_s: NDArray[np.float64], skew_s: NDArray[np.float64]) -> float:
    """Slope by least squares, times the time it runs over."""
    centred = time_s - time_s.mean()
    spread = float(centred @ centred)
    if spread <= 0.0:
        return 0.0
    return float(centred @ (skew_s - skew_s.mean())) / spread * float(np.ptp(time_s))
