"""Glass by peaks of intensity along a ring: the detector of Wang and Wang (2017)."""

from __future__ import annotations

import math
from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from graspe_data.arrays import Floats, Indices
from graspe_data.errors import PlannerError
from graspe_data.manifest import Settings
from graspe_data.observation.ring_order import ring_order
from graspe_data.sensor_data import PointCloud

_SAME = 2e-4
"""rad: less than a tenth of the finest step between beams of a VLP-16."""


class PeakSettings(Settings):
    """What counts as a peak; for a VLP-16 at 10 Hz, whose intensities are 0..255."""

    least: Annotated[float, Field(ge=0)] = 120.0
    """T_int: a peak rises above this, of 255."""
    step: Annotated[float, Field(gt=0)] = 60.0
    """D: it rises by at least this from one beam to the next, and falls by more than this."""
    width: Annotated[int, Field(ge=1)] = 7
    """W: beams from the one before the rise to the fall, 1.25 degrees of 0.2 each."""
    gate: Annotated[float, Field(gt=0)] = 0.1
    """Metres by which the range before the rise and at the fall may differ."""
    farthest: Annotated[float, Field(gt=0)] = 10.0
    """Metres: farther returns are passed over, as if the beam had given none."""
    elevation: Annotated[float, Field(gt=0, lt=math.pi / 2)] = math.radians(3.5)
    """Rings no steeper than this are looked at, rad; four of a VLP-16's."""


def glass_peaks(cloud: PointCloud, rings: int | None, settings: PeakSettings) -> Floats:
    """Find glass in a cloud, float64 (G, 3), metres, in the cloud's frame.

    The detector runs over each near-horizontal ring in the order of azimuth, over the nearest
    return of each beam (a lidar with dual returns gives two): see ``peaks``. Rings are not closed
    across the azimuth pi, behind the sensor.

    Args:
        cloud: With intensity, in the lidar's own frame.
        rings: How many the lidar has, where the cloud does not name them.
        settings: See ``PeakSettings``.

    Raises:
        PlannerError: The cloud has no intensity.
    """
    xyz, strength = cloud.xyz, cloud.intensity
    if strength is None:
        raise PlannerError(
            "no glass: the cloud has no intensity, and peaks are found in nothing else: record "
            "the field, or drive by an occupancy map."
        )
    found = []
    ordered = ring_order(xyz, cloud.ring, rings, strength)
    for first, last in zip(ordered.ring_starts[:-1], ordered.ring_starts[1:], strict=True):
        beams = _beams(xyz, ordered.order[first:last], settings)
        reach = np.linalg.norm(xyz[beams].astype(np.float64), axis=1)
        found.append(beams[peaks(strength[beams].astype(np.float64), reach, settings)])
    rows = np.concatenate([np.empty(0, np.int64), *found])
    return np.asarray(xyz[rows], np.float64)


def peaks(intensity: Floats, reach: Floats, settings: PeakSettings) -> Indices:
    """The middle beams of peaks in one ring, rising.

    With g the change from the beam before: a beam above T_int with g >= D rises, and the beam
    before it is the peak's start, in place of an earlier one. Any other beam with g < -D ends it,
    if start and end are at most W beams and the gate's metres of range apart; the middle beam is
    glass, and the start is forgotten.

    Args:
        intensity: float64 (N,), of the ring's beams in order.
        reach: float64 (N,), their ranges, metres.
        settings: T_int, D, W and the gate.
    """
    # g, and the beams that rise and that fall.
    change = np.diff(intensity)
    risen = (intensity[1:] > settings.least) & (change >= settings.step)
    starts, ends = np.flatnonzero(risen), np.flatnonzero(change < -settings.step) + 1
    if not len(starts):
        return np.empty(0, np.int64)
    # starts[k] lies before the beam that rises: a rise at the very beam of a fall cannot be.
    latest = np.searchsorted(starts, ends, side="left") - 1
    ends, latest = ends[latest >= 0], latest[latest >= 0]
    start = starts[latest]
    # Start and end are near in range and in beams.
    close = np.abs(reach[start] - reach[ends]) < settings.gate
    fits = (ends - start <= settings.width) & close
    ends, latest = ends[fits], latest[fits]
    # The first fall after a start ends its peak; later ones have none.
    used, first = np.unique(latest, return_index=True)
    middle: Indices = starts[used] + (ends[first] - starts[used]) // 2
    return middle


def _beams(xyz: NDArray[np.float32], ring: Indices, settings: PeakSettings) -> Indices:
    """Those of a ring's returns that the detector looks at: the nearest of each azimuth."""
    x, y, z = xyz[ring].T.astype(np.float64)
    across = np.hypot(x, y)
    if abs(float(np.median(np.arctan2(z, across)))) > settings.elevation:
        return ring[:0]
    near = np.hypot(across, z) <= settings.farthest
    ring, x, y = ring[near], x[near], y[near]
    # Returns of one beam lie in exactly one direction but for rounding; nearer ones stand first.
    azimuth = np.arctan2(y, x)
    order = np.lexsort((np.hypot(x, y), np.round(azimuth / _SAME)))
    ring, azimuth = ring[order], azimuth[order]
    fresh = np.diff(azimuth, prepend=-np.inf) > _SAME / 2
    return np.asarray(ring[fresh])
