"""Distances between capsules on the ground."""

from __future__ import annotations

import numpy as np

from graspe_data.arrays import Floats
from graspe_data.simulation.world.plan import Spots


def capsule_gaps(first: Spots, second: Spots) -> Floats:
    """Metres (N, M) between the surfaces of N and M capsules; negative where they overlap.

    Two segments that do not cross are nearest at an end of one of them.
    """
    a, b = first.start[:, None], first.end[:, None]
    c, d = second.start[None], second.end[None]
    near = np.minimum(
        np.minimum(_to_segment(a, c, d), _to_segment(b, c, d)),
        np.minimum(_to_segment(c, a, b), _to_segment(d, a, b)),
    )
    between = np.where(_cross(a, b, c, d), 0.0, near)
    gaps: Floats = between - first.radius[:, None] - second.radius[None]
    return gaps


def _to_segment(point: Floats, start: Floats, end: Floats) -> Floats:
    span = end - start
    square = np.maximum((span**2).sum(axis=-1), 1e-18)
    share = np.clip(((point - start) * span).sum(axis=-1) / square, 0.0, 1.0)
    distance: Floats = np.linalg.norm(point - start - share[..., None] * span, axis=-1)
    return distance


def _cross(a: Floats, b: Floats, c: Floats, d: Floats) -> np.ndarray[tuple[int, int]]:
    sides = _turn(a, b, c) * _turn(a, b, d), _turn(c, d, a) * _turn(c, d, b)
    crossing: np.ndarray[tuple[int, int]] = (sides[0] < 0) & (sides[1] < 0)
    return crossing


def _turn(a: Floats, b: Floats, c: Floats) -> Floats:
    first, second = b - a, c - a
    turn: Floats = first[..., 0] * second[..., 1] - first[..., 1] * second[..., 0]
    return turn
