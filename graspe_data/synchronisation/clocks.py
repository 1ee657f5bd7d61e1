"""One time for all topics: header stamps, bag time, the skew between them, constant offsets."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from graspe_data.arrays import Stamps
from graspe_data.errors import RecordingError
from graspe_data.manifest import Positive, Settings
from graspe_data.robot import Clock
from graspe_data.synchronisation.tracks import StampTrack

SECOND = 1_000_000_000
DAY_S = 86_400
LONGEST_PAUSE_S = 0.5


class ClockSettings(Settings):
    """How far apart clocks may be before rows are refused."""

    maximum_skew_s: Positive = 1.0
    """Largest difference between a topic's skew and the camera's, after its offset."""
    constant_within_s: Positive = 0.2
    """How far the difference may run over the recording: beyond it, clocks drift or jump."""


@dataclass(frozen=True)
class Timeline:
    """A topic's messages in time: int64 ns on the camera's clock, in the reader's order.

    ``offset_ns`` is what was added to the topic's own stamps; ``source`` says which stamps.
    """

    topic: str
    stamps_ns: Stamps
    offset_ns: int
    source: str

    def shifted(self, shift_ns: int) -> Timeline:
        """The same messages later on the axis of the recording."""
        return Timeline(self.topic, self.stamps_ns + shift_ns, self.offset_ns, self.source)


def skew_ns(track: StampTrack) -> Stamps:
    """Bag time minus header stamp of each message, int64 ns; zero for a type without header."""
    if track.header_ns is None:
        return np.zeros_like(track.bag_ns)
    return track.bag_ns - track.header_ns


def camera_timeline(track: StampTrack, clock: Clock) -> Timeline:
    """The camera's own time, to which every other topic is held.

    Raises:
        RecordingError: The stamps asked for are absent or zero.
    """
    stamps, source = _own_stamps(track, clock)
    offset = _declared_ns(track, clock, "it is measured against the camera itself")
    return Timeline(track.topic, stamps + offset, offset, source)


def timeline(
    track: StampTrack,
    clock: Clock,
    camera: StampTrack,
    camera_time: Timeline,
    limits: ClockSettings,
) -> Timeline:
    """Bring a topic onto the camera's clock.

    A type without header (a Twist) has only its bag time; it is carried over by the camera's skew
    at that moment, so that a header clock which drifts from the recorder's does not shift it.

    Raises:
        RecordingError: The clocks are unrelated, or differ by a constant that nobody declared;
            names both topics, the skew and its spread, and the key to set.
    """
    camera_skew = _camera_skew_at(track.bag_ns, camera, camera_time)
    if track.header_ns is None:
        offset = _declared_ns(track, clock, "its messages have no header stamp to measure by")
        stamps = track.bag_ns - camera_skew + offset
        return Timeline(track.topic, stamps, offset, "bag time, by the camera's skew")
    stamps, source = _own_stamps(track, clock)
    near = _between_pictures(track.bag_ns, camera)
    difference = (track.bag_ns - stamps - camera_skew)[near]
    low, middle, high = _course(difference[np.argsort(track.bag_ns[near], kind="stable")])
    constant = high - low <= limits.constant_within_s * SECOND
    if clock.offset_s == "measured":
        own_skew = (track.bag_ns - stamps)[near]
        offset = _least_ns(own_skew, track.bag_ns[near], camera, camera_time)
        offset -= round(clock.latency_s * SECOND)
    else:
        offset = _declared_ns(track, clock, "")
    if not constant:
        advice = "it is not constant, so the clocks are unrelated"
        raise _unrelated(track, camera, low, middle, high, advice)
    if abs(middle - offset) > limits.maximum_skew_s * SECOND:
        raise _unrelated(track, camera, low, middle, high, _advice(middle))
    return Timeline(track.topic, stamps + offset, offset, source)


def _between_pictures(bag_ns: Stamps, camera: StampTrack) -> NDArray[np.bool_]:
    """Which messages came while pictures came: the camera's skew is known there."""
    pictures = np.sort(camera.bag_ns)
    if pictures.size == 1:
        return np.ones(bag_ns.size, np.bool_)
    after = np.clip(np.searchsorted(pictures, bag_ns), 1, pictures.size - 1)
    interval = pictures[after] - pictures[after - 1]
    inside = (bag_ns >= pictures[0]) & (bag_ns <= pictures[-1])
    near = inside & (interval <= max(LONGEST_PAUSE_S * SECOND, 3 * float(np.median(interval))))
    return near if near.any() else np.ones(bag_ns.size, np.bool_)


def _course(difference_ns: Stamps) -> tuple[int, int, int]:
    """The lowest, middle and highest of the medians of ten stretches of a recording.

    Medians are blind to messages that the recorder got late, and see clocks that drift or jump.
    """
    stretches = np.array_split(difference_ns, max(1, min(10, difference_ns.size // 5)))
    medians = [float(np.median(stretch)) for stretch in stretches]
    return round(min(medians)), round(float(np.median(difference_ns))), round(max(medians))


def _least_ns(skew: Stamps, bag_ns: Stamps, camera: StampTrack, camera_time: Timeline) -> int:
    """The difference of two skews where each is least, as the median over ten parts of the time.

    A message comes late by what the network and the sensor need; the quickest one says most.
    """
    camera_own = camera.bag_ns - camera_time.stamps_ns
    parts = max(1, min(10, skew.size // 5, camera_own.size // 5))
    edges = np.linspace(bag_ns.min(), bag_ns.max(), parts + 1)[1:-1]
    mine, theirs = np.searchsorted(edges, bag_ns), np.searchsorted(edges, camera.bag_ns)
    both = [k for k in range(parts) if (mine == k).any() and (theirs == k).any()]
    least = [int(skew[mine == k].min()) - int(camera_own[theirs == k].min()) for k in both]
    return round(float(np.median(least))) if least else int(skew.min() - camera_own.min())


def _declared_ns(track: StampTrack, clock: Clock, why_not: str) -> int:
    if clock.offset_s == "measured":
        raise RecordingError(
            f"{track.topic}: `offset_s: measured` cannot be: {why_not}. Declare seconds."
        )
    return round(clock.offset_s * SECOND)


def _advice(difference_ns: int) -> str:
    if abs(difference_ns) > DAY_S * SECOND:
        return (
            "the clocks are unrelated, and the difference is constant: of a sensor that counts "
            "from when it was switched on, set `offset_s: measured` under `clocks` for this topic"
        )
    return (
        "it is constant: if the sensors did run together, set `offset_s: "
        f"{difference_ns / SECOND:.3f}` (or `measured`) under `clocks` for this topic"
    )


def _own_stamps(track: StampTrack, clock: Clock) -> tuple[Stamps, str]:
    if clock.stamp == "bag" or track.header_ns is None:
        return track.bag_ns, "bag time"
    if not np.any(track.header_ns):
        raise RecordingError(
            f"{track.topic}: all header stamps are zero. Set `clocks` to `stamp: bag` for this "
            f"topic if the recorder's time will do."
        )
    return track.header_ns, "header stamp"


def _camera_skew_at(bag_ns: Stamps, camera: StampTrack, camera_time: Timeline) -> Stamps:
    order = np.argsort(camera.bag_ns, kind="stable")
    origin = camera.bag_ns[order[0]]
    known = (camera.bag_ns - origin)[order].astype(np.float64)
    skew = (camera.bag_ns - camera_time.stamps_ns)[order]
    base = skew[0]
    moved = np.interp((bag_ns - origin).astype(np.float64), known, (skew - base).astype(np.float64))
    carried: Stamps = np.rint(moved).astype(np.int64) + base
    return carried


def _unrelated(
    track: StampTrack, camera: StampTrack, low: int, middle: int, high: int, advice: str
) -> RecordingError:
    return RecordingError(
        f"clocks differ: {track.topic} against {camera.topic}: the difference between their "
        f"skews (bag time minus header stamp) is {middle / SECOND:.3f} s, and runs from "
        f"{low / SECOND:.3f} to {high / SECOND:.3f} s: {advice}. No rows are made."
    )
