"""One time for all topics: header stamps, bag time, the skew between them, constant offsets."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from graspe_data.errors import RecordingError
from graspe_data.manifest import Settings
from graspe_data.recordings.tracks import Stamps, StampTrack
from graspe_data.robot import Clock

SECOND = 1_000_000_000
DAY_S = 86_400


class ClockSettings(Settings):
    """How far apart clocks may be before rows are refused."""

    maximum_skew_s: float = 1.0
    """Largest difference between a topic's skew and the camera's, after its offset."""
    constant_within_s: float = 0.2
    """A skew whose 5th to 95th percentile lies within this is constant."""


@dataclass(frozen=True)
class Timeline:
    """A topic's messages in time: int64 ns on the camera's clock, in the reader's order.

    ``offset_ns`` is what was added to the topic's own stamps; ``source`` says which stamps.
    """

    topic: str
    stamps_ns: Stamps
    offset_ns: int
    source: str


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
    offset = 0 if clock.offset_s == "measured" else round(clock.offset_s * SECOND)
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
        stamps = track.bag_ns - camera_skew
        return Timeline(track.topic, stamps, 0, "bag time, by the camera's skew")
    stamps, source = _own_stamps(track, clock)
    difference = track.bag_ns - stamps - camera_skew
    low, middle, high = (round(q) for q in np.percentile(difference, (5, 50, 95)))
    constant = high - low <= limits.constant_within_s * SECOND
    if clock.offset_s == "measured":
        if not constant:
            advice = "the clocks are unrelated, so no offset can be measured"
            raise _unrelated(track, camera, low, middle, high, advice)
        offset = middle
    else:
        offset = round(clock.offset_s * SECOND)
    if abs(middle - offset) > limits.maximum_skew_s * SECOND:
        raise _unrelated(track, camera, low, middle, high, _advice(middle, constant=constant))
    return Timeline(track.topic, stamps + offset, offset, source)


def _advice(difference_ns: int, *, constant: bool) -> str:
    if not constant or abs(difference_ns) > DAY_S * SECOND:
        return "the clocks are unrelated"
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
