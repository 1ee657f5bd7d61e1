"""How many stamps of a sensor have a companion on another topic, by either clock, and why not."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from graspe_data.errors import RecordingError
from graspe_data.recordings.clocks import SECOND, ClockSettings, camera_timeline, timeline
from graspe_data.recordings.synchronisation import pair_nearest
from graspe_data.recordings.tracks import Stamps, StampTrack
from graspe_data.robot import Clock

TOLERANCE_S: Final = 0.05


@dataclass(frozen=True)
class Pairing:
    """Of ``messages`` on a sensor's topic, those with odometry within 50 ms, by either clock.

    ``by_header`` is None where one of the topics is not stamped. ``reason`` says what is wrong
    between the two, None where nothing is.
    """

    sensor: str
    odometry: str
    messages: int
    by_header: int | None
    by_bag: int
    reason: str | None


def pair_topics(sensor: StampTrack, odometry: StampTrack) -> Pairing:
    """Pair two topics that both have messages, within 50 ms."""
    by_header = None
    if sensor.header_ns is not None and odometry.header_ns is not None:
        by_header = _count(sensor.header_ns, odometry.header_ns)
    by_bag = _count(sensor.bag_ns, odometry.bag_ns)
    reason = _clock_fault(sensor, odometry)
    if reason is None and not (by_bag if by_header is None else by_header):
        reason = "no two messages are close: " + _apart(sensor, odometry)
    elif reason is not None and not by_bag:
        reason += " In bag time: " + _apart_in(sensor.bag_ns, odometry.bag_ns)
    return Pairing(sensor.topic, odometry.topic, sensor.bag_ns.size, by_header, by_bag, reason)


def _count(stamps: Stamps, others: Stamps) -> int:
    return int(np.count_nonzero(pair_nearest(stamps, others, TOLERANCE_S) >= 0))


def _clock_fault(sensor: StampTrack, odometry: StampTrack) -> str | None:
    try:
        timeline(odometry, Clock(), sensor, camera_timeline(sensor, Clock()), ClockSettings())
    except RecordingError as error:
        return str(error)
    return None


def _apart(sensor: StampTrack, odometry: StampTrack) -> str:
    if sensor.header_ns is None or odometry.header_ns is None:
        return "by bag time, " + _apart_in(sensor.bag_ns, odometry.bag_ns)
    return "by header stamp, " + _apart_in(sensor.header_ns, odometry.header_ns)


def _apart_in(stamps: Stamps, others: Stamps) -> str:
    """Say how two spans of time lie to each other."""
    before = int(others.min()) - int(stamps.max())
    after = int(stamps.min()) - int(others.max())
    if before > 0:
        return f"the sensor ends {before / SECOND:.3f} s before the odometry begins."
    if after > 0:
        return f"the odometry ends {after / SECOND:.3f} s before the sensor begins."
    return f"they overlap, yet no two are within {TOLERANCE_S} s."
