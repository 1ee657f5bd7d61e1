"""How far the robot's rectangle is from what stands on the ground."""

from __future__ import annotations

import numpy as np

from graspe_data.arrays import Floats
from graspe_data.robot import Footprint
from graspe_data.simulation.world.obstacles import Obstacles

Pair = tuple[Floats, Floats]


def clearance(footprint: Footprint, poses: Floats, obstacles: Obstacles) -> Floats:
    """Signed distance in metres of the robot at poses (P, 3) from N obstacles, float64 (P, N).

    As ``capsule_clearance``.
    """
    return capsule_clearance(
        footprint, poses[:, None], obstacles.start, obstacles.end, obstacles.radius
    )


def capsule_clearance(
    footprint: Footprint, poses: Floats, start: Floats, end: Floats, radius: Floats | float
) -> Floats:
    """Signed distance in metres between the robot's rectangle and capsules, exact.

    Apart, it is the distance; overlapping, minus the shortest way that would part them (the
    separating axes of the rectangle and the segment).

    Args:
        footprint: Length and width of the rectangle, centred on base_link.
        poses: (..., 3) x, y, yaw of base_link; world frame, metres, rad.
        start: (..., 2), one end of the capsule's segment; shapes are broadcast.
        end: (..., 2), its other end.
        radius: (...), metres.
    """
    half = (footprint.length / 2, footprint.width / 2)
    a, b = _in_base(poses, start), _in_base(poses, end)
    apart = _separation(a, b, half)
    signed: Floats = np.where(apart < 0, apart, _distance(a, b, half)) - radius
    return signed


def _in_base(poses: Floats, points: Floats) -> Pair:
    x, y = points[..., 0] - poses[..., 0], points[..., 1] - poses[..., 1]
    cosine, sine = np.cos(poses[..., 2]), np.sin(poses[..., 2])
    return cosine * x + sine * y, cosine * y - sine * x


def _separation(a: Pair, b: Pair, half: tuple[float, float]) -> Floats:
    """Largest gap along the normals of the rectangle and the segment; negative if they overlap."""
    gaps = [
        np.maximum(np.minimum(p, q), -np.maximum(p, q)) - h
        for p, q, h in zip(a, b, half, strict=True)
    ]
    normal = a[1] - b[1], b[0] - a[0]
    length = np.hypot(*normal)
    reach = half[0] * np.abs(normal[0]) + half[1] * np.abs(normal[1])
    across = np.abs(normal[0] * a[0] + normal[1] * a[1]) - reach
    gaps.append(np.where(length > 0, across / np.where(length > 0, length, 1.0), -np.inf))
    return np.maximum(np.maximum(gaps[0], gaps[1]), gaps[2])


def _distance(a: Pair, b: Pair, half: tuple[float, float]) -> Floats:
    """Of a segment outside of the rectangle: an end or a corner is the nearest point."""
    ends = np.minimum(_from_rectangle(a, half), _from_rectangle(b, half))
    along = b[0] - a[0], b[1] - a[1]
    square = along[0] ** 2 + along[1] ** 2
    square = np.where(square > 0, square, 1.0)
    for corner in ((1, 1), (1, -1), (-1, 1), (-1, -1)):
        x, y = corner[0] * half[0] - a[0], corner[1] * half[1] - a[1]
        share = np.clip((x * along[0] + y * along[1]) / square, 0.0, 1.0)
        ends = np.minimum(ends, np.hypot(x - share * along[0], y - share * along[1]))
    return ends


def _from_rectangle(point: Pair, half: tuple[float, float]) -> Floats:
    x, y = np.abs(point[0]) - half[0], np.abs(point[1]) - half[1]
    distance: Floats = np.hypot(np.maximum(x, 0.0), np.maximum(y, 0.0))
    return distance
