"""Lines on the ground."""

from __future__ import annotations

import numpy as np

from graspe_data.arrays import Floats
from graspe_data.simulation.world.plan import Spots
from graspe_data.simulation.world.world import Ground

SAMPLES = 64


def line_lengths(spots: Spots) -> Floats:
    """Lengths (N,) of the segments, metres."""
    lengths: Floats = np.linalg.norm(spots.end - spots.start, axis=1)
    return lengths


def part_of_lines(spots: Spots, begin: Floats, stop: Floats) -> Spots:
    """The part of each segment between two distances (N,) from its start, metres."""
    unit = (spots.end - spots.start) / line_lengths(spots)[:, None]
    start, end = (spots.start + unit * way[:, None] for way in (begin, stop))
    return Spots(start, end, spots.radius)


def line_levels(spots: Spots, ground: Ground) -> tuple[Floats, Floats]:
    """Lowest and highest ground (N,) under each segment, metres."""
    share = np.linspace(0.0, 1.0, SAMPLES)[:, None]
    points = spots.start[:, None] * (1 - share) + spots.end[:, None] * share
    heights = ground.height(points[..., 0], points[..., 1])
    return heights.min(axis=1), heights.max(axis=1)
