"""The lines of a starting manifest about frames, height, velocities and limits."""

from __future__ import annotations

from collections.abc import Iterator
from math import ceil, floor
from typing import Final

import numpy as np

from graspe_data.errors import GeometryError
from graspe_data.geometry import Transform
from graspe_data.inspection.evidence import Evidence
from graspe_data.inspection.manifest_lines import ManifestLine
from graspe_data.inspection.topic_content import CloudContent

_ON_THE_GROUND_M: Final = 0.1
_UNKNOWN: Final = (0.0, "missing: metres from the ground to the base frame")


def base_height(evidence: Evidence, base: str) -> tuple[float, str]:
    """Height of the base above the ground in metres: by base_footprint, or by the lowest points.

    Returns:
        The height, and the note for the manifest: where it was found, or that it is missing.
    """
    footprint = fixed_transform(evidence, base, "base_footprint")
    if footprint is not None:
        height = round(float(-footprint.translation[2]), 3)
        return height + 0.0, "from tf: base_footprint is on the ground"
    points = evidence.survey.topics.get(evidence.choice.topics.get("points", ""))
    content = None if points is None else points.content
    if points is None or not isinstance(content, CloudContent) or content.ground_z is None:
        return _UNKNOWN
    placed = fixed_transform(evidence, base, points.frame)
    if placed is None:
        return _UNKNOWN
    ground = float(placed.apply(np.array([0.0, 0.0, content.ground_z]))[2])
    height = 0.0 if abs(ground) < _ON_THE_GROUND_M else round(-ground, 2)
    where = f"{abs(ground):.2f} m {'above' if ground > 0 else 'below'} {base}"
    return height, f"guess: {points.info.name} sees most low points {where}; measure it"


def fixed_transform(evidence: Evidence, base: str, frame: str) -> Transform | None:
    """The last fixed transform from a frame to the base by tf; None where there is none."""
    try:
        return evidence.transforms.changes(base, frame)[-1][1]
    except GeometryError:
        return None


Lines = Iterator[ManifestLine]
Range = tuple[float, float]


def frame_lines(evidence: Evidence) -> Lines:
    """The base and odometry frames, and how high the base is."""
    odometry = evidence.topic("odometry")
    source = "missing: no odometry; " if odometry is None else f"from {odometry.info.name}"
    guess = "guess: the usual name"
    tracks = evidence.tracks
    has_child = tracks is None or tracks.odometry is None or tracks.odometry.child_frame
    base, odom = evidence.base_frame, evidence.choice.odometry_frame
    yield ManifestLine(
        0, "base_frame", base, source if odometry is not None and has_child else guess
    )
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
