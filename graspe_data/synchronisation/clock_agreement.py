"""Clocks against each other over all stretches: one that was set, one that is late."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from graspe_data.arrays import Stamps
from graspe_data.robot import Robot
from graspe_data.synchronisation.clocks import SECOND, ClockSettings, Timeline
from graspe_data.synchronisation.findings import Finding
from graspe_data.synchronisation.timed_stretch import TimedStretch
from graspe_data.synchronisation.tracks import StampTrack

_LATE_S: Final = 0.25


def set_clocks(stretches: Sequence[TimedStretch | None], limits: ClockSettings) -> list[str]:
    """Of each stretch, in words, which sensor's clock runs otherwise than in the rest; or nothing.

    A clock that one sensor alone had set in mid-run is right on one side of that place only: where
    it differs least from the camera's.
    """
    present = [k for k, stretch in enumerate(stretches) if stretch is not None]
    faults = [""] * len(stretches)
    for number in range(2):
        apart = {k: _apart_s(stretch, number) for k in present if (stretch := stretches[k])}
        usual = min(apart.values(), key=abs)
        for k, seconds in apart.items():
            stretch = stretches[k]
            if stretch is not None and abs(seconds - usual) > limits.constant_within_s:
                track, _ = _sensors(stretch)[number]
                both = f"{track.topic} against {stretch.image.topic}"
                faults[k] = (
                    f"clocks differ: {both} by {seconds:.3f} s in this stretch, and by "
                    f"{usual:.3f} s in another: one of these clocks was set. No rows are made."
                )
    return faults


def _sensors(stretch: TimedStretch) -> list[tuple[StampTrack, Timeline]]:
    return [
        (stretch.tracks.points, stretch.points),
        (stretch.odometry.stamps, stretch.odometry_time),
    ]


def _apart_s(stretch: TimedStretch, number: int) -> float:
    """How much longer than a picture a message comes after its stamp, as a rule."""
    track, time = _sensors(stretch)[number]
    if track.header_ns is None:
        return 0.0
    own = track.bag_ns - time.stamps_ns
    camera = stretch.tracks.image.bag_ns - stretch.image.stamps_ns
    return float(np.median(own) - np.median(camera)) / SECOND


def late_sensors(stretch: TimedStretch) -> list[Finding]:
    """Sensors whose messages come much later, or sooner, after their stamps than pictures do."""
    camera = _least_s(stretch.tracks.image.bag_ns, stretch.image.stamps_ns)
    found = []
    for track, time in _sensors(stretch):
        apart = _least_s(track.bag_ns, time.stamps_ns) - camera
        if abs(apart) > _LATE_S:
            how = "later" if apart > 0 else "sooner"
            text = (
                f"{time.topic}: its messages come {abs(apart):.3f} s {how} after their stamps than "
                f"pictures do: a slow driver, or a clock of its own. If it is the clock, set "
                f"`offset_s: {apart:.3f}` (or `measured`) under `clocks` for this topic"
            )
            found.append(Finding("sensor_late", "noted", time.topic, text, {"late_s": apart}))
    return found


def _least_s(bag_ns: Stamps, stamps_ns: Stamps) -> float:
    return float(np.min(bag_ns - stamps_ns)) / SECOND


def measured_offsets(stretch: TimedStretch, robot: Robot) -> list[Finding]:
    """What was measured between clocks, and what it cannot tell."""
    times = ((stretch.points, robot.clocks.points), (stretch.odometry_time, robot.clocks.odometry))
    found = []
    for time, clock in times:
        if clock.offset_s == "measured":
            offset = time.offset_ns / SECOND
            text = (
                f"{time.topic}: {offset:+.6f} s are added to its stamps, measured where its "
                f"messages and pictures come soonest; what the former need longer than the latter "
                f"even then is in it, unless `latency_s` ({clock.latency_s:g} s) takes it off"
            )
            numbers = {"offset_s": offset}
            found.append(Finding("offset_measured", "mended", time.topic, text, numbers))
    return found
