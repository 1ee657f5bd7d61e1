"""How many stamps of a sensor have a companion on another topic, by either clock, and why not."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from graspe_data.arrays import Stamps
from graspe_data.errors import RecordingError
from graspe_data.robot import Clock
from graspe_data.synchronisation.clocks import SECOND, ClockSettings, camera_timeline, timeline
from graspe_data.synchronisation.row_plan import pair_nearest
from graspe_data.synchronisation.tracks import StampTrack

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
        clock = "bag time" if by_header is None else "header stamp"
        reason = f"By {clock}, {_apart(sensor, odometry)}"
    elif reason is not None and not by_bag:
        reason += f" By bag time, {_apart(sensor, odometry, by_bag=True)}"
    return Pairing(sensor.topic, odometry.topic, sensor.bag_ns.size, by_header, by_bag, reason)


def _count(stamps: Stamps, others: Stamps) -> int:
    return int(np.count_nonzero(pair_nearest(stamps, others, TOLERANCE_S) >= 0))


def _clock_fault(sensor: StampTrack, odometry: StampTrack) -> str | None:
    try:
        timeline(odometry, Clock(), sensor, camera_timeline(sensor, Clock()), ClockSettings())
    except RecordingError as error:
        return str(error)
    return None


def _apart(sensor: StampTrack, odometry: StampTrack, *, by_bag: bool = False) -> str:
    """Say how the two lie to each other in time."""
    stamps, others = sensor.header_ns, odometry.header_ns
    if by_bag or stamps is None or others is None:
        stamps, others = sensor.bag_ns, odometry.bag_ns
    for early, late, wait in (
        (sensor.topic, odometry.topic, int(others.min()) - int(stamps.max())),
        (odometry.topic, sensor.topic, int(stamps.min()) - int(others.max())),
    ):
        if wait > 0:
            return f"{early} ends {wait / SECOND:.3f} s before {late} begins."
    return f"they overlap, yet no two messages are within {TOLERANCE_S} s."
