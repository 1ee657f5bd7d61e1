"""Oscillation: turning to and fro without getting anywhere."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from pydantic import Field

from graspe_data.arrays import Floats
from graspe_data.manifest import Positive, Settings
from graspe_data.observation.labels.events import Event, Indices, join_intervals
from graspe_data.observation.labels.motion_series import OdometrySeries


class OscillationSettings(Settings):
    """When turning counts as oscillation in place."""

    yaw_rate: Positive = 0.2
    """rad/s; slower turning has no direction."""
    reversals: Annotated[int, Field(ge=1)] = 3
    window_s: Positive = 4.0
    displacement: Positive = 0.3
    """Metres; in the window the robot stays nearer than this to where it was at its start."""


def oscillation_events(odometry: OdometrySeries, settings: OscillationSettings) -> list[Event]:
    """Propose the intervals of oscillation, from the first reversal to the last.

    The displacement is that of the middle and of the end of the window from its start, so a gait
    that sways while the robot walks on does not count, however fast it sways.
    """
    stamps = odometry.stamps_ns
    window_ns = round(settings.window_s * 1e9)
    begins = np.flatnonzero(stamps <= stamps[-1] - window_ns)
    reversals = stamps[_reversals(odometry.omega, settings.yaw_rate)]
    first = np.searchsorted(reversals, stamps[begins])
    after = np.searchsorted(reversals, stamps[begins] + window_ns, side="right")
    in_place = _displacement(odometry, begins, window_ns) < settings.displacement
    found = in_place & (after - first >= settings.reversals)
    starts, stops = reversals[first[found]], reversals[after[found] - 1]
    evidence = f"at least {settings.reversals} reversals in place"
    return [
        Event("oscillation", int(start), int(stop), evidence)
        for start, stop in zip(*join_intervals(starts, stops, 0), strict=True)
    ]


def _reversals(omega: Floats, threshold: float) -> Indices:
    """Samples that turn decidedly, the other way than the decided one before."""
    decided = np.flatnonzero(np.abs(omega) > threshold)
    turned = np.diff(np.sign(omega[decided])) != 0
    reversals: Indices = decided[1:][turned]
    return reversals


def _displacement(odometry: OdometrySeries, begins: Indices, window_ns: int) -> Floats:
    start = odometry.stamps_ns[begins]
    distances = []
    for later in (start + window_ns // 2, start + window_ns):
        x, y, *_ = odometry.at(later)
        distances.append(np.hypot(x - odometry.x[begins], y - odometry.y[begins]))
    return np.maximum(*distances)
