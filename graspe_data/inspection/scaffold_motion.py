"""The lines of a starting manifest about frames, velocities and limits."""

from __future__ import annotations

from collections.abc import Iterator
from math import ceil, floor

import numpy as np

from graspe_data.inspection.base_height import base_height
from graspe_data.inspection.evidence import Evidence
from graspe_data.inspection.manifest_lines import ManifestLine

Lines = Iterator[ManifestLine]
Range = tuple[float, float]


def frame_lines(evidence: Evidence) -> Lines:
    """The base and odometry frames, and how high the base is."""
    odometry = evidence.topic("odometry")
    source = "missing: no odometry; " if odometry is None else f"from {odometry.info.name}"
    guess = "guess: the usual name"
    tracks = evidence.tracks
    told = tracks is None or tracks.odometry is None or tracks.odometry.child_frame
    base, odom = evidence.base_frame, evidence.choice.odometry_frame
    yield ManifestLine(0, "base_frame", base, source if odometry is not None and told else guess)
    yield ManifestLine(0, "odometry_frame", odom, source if odometry is not None else guess)
    height, note = base_height(evidence, base)
    yield ManifestLine(0, "base_height", height, note)


def motion_lines(evidence: Evidence) -> Lines:
    """What velocities are taken from, with the ground of it."""
    about = [f for f in evidence.findings if "twist_m" in f.numbers]
    note = f"found: {about[0].text}" if about else "guess: twist and poses decide"
    yield ManifestLine(0, "odometry_velocity", "checked", note)


def limit_lines(evidence: Evidence) -> Lines:
    """The ranges of velocity that were driven, rounded outwards to a tenth and around zero."""
    linear = yaw = None
    if evidence.planned is not None:
        velocity = evidence.planned.odometry.velocity
        low, high = np.percentile(velocity, (0.1, 99.9), axis=0)
        linear, yaw = (float(low[0]), float(high[0])), (float(low[1]), float(high[1]))
    yield ManifestLine(0, "limits")
    yield _limit("linear_velocity", linear, (0.0, 1.0), "m/s")
    yield _limit("yaw_rate", yaw, (-1.0, 1.0), "rad/s")


def _limit(key: str, observed: Range | None, usual: Range, unit: str) -> ManifestLine:
    if observed is None or not any(round(value, 3) for value in observed):
        return ManifestLine(1, key, usual, f"missing: {unit}, no motion was observed")
    low, high = min(observed[0], 0.0), max(observed[1], 0.0)
    outwards = (floor(low * 10 + 1e-9) / 10 + 0.0, ceil(high * 10 - 1e-9) / 10 + 0.0)
    note = f"guess: {unit}, observed {observed[0]:.2f} to {observed[1]:.2f}"
    return ManifestLine(1, key, outwards, note)
