"""Turns between rotations as vectors: axis times angle, in rad."""

from __future__ import annotations

import numpy as np

from graspe_data.arrays import Floats
from graspe_data.geometry import quaternion_from_rotation

_STRAIGHT_RAD = 1e-6


def rotation_vectors(rotation: Floats) -> Floats:
    """Axis times angle in rad (N, 3), at most pi long, of rotations (N, 3, 3)."""
    quaternion = quaternion_from_rotation(rotation)
    quaternion = quaternion * np.where(quaternion[:, 3:] < 0, -1.0, 1.0)
    sine = np.linalg.norm(quaternion[:, :3], axis=1)
    angle = 2 * np.arctan2(sine, quaternion[:, 3])
    straight = sine < _STRAIGHT_RAD
    scale = np.where(straight, 2.0, angle / np.where(straight, 1.0, sine))
    vectors: Floats = quaternion[:, :3] * scale[:, None]
    return vectors


def turns_in_fixed(rotation: Floats) -> Floats:
    """The turn from each rotation (N, 3, 3) to the next, in the fixed frame, (N - 1, 3)."""
    return rotation_vectors(rotation[1:] @ np.swapaxes(rotation[:-1], 1, 2))


def twist_between(
    before: tuple[Floats, Floats], after: tuple[Floats, Floats]
) -> tuple[Floats, Floats]:
    """The constant body twist that leads from one pose to another in a unit of time.

    The logarithm of the motion in SE(3); exact on arcs and screws, where chords are too short.

    Args:
        before: Positions (N, 3) and rotations (N, 3, 3).
        after: The same, less than half a turn on.

    Returns:
        Linear (N, 3) in metres and angular (N, 3) in rad.
    """
    back = np.swapaxes(before[1], 1, 2)
    chord = np.einsum("nij,nj->ni", back, after[0] - before[0])
    turn = rotation_vectors(back @ after[1])
    half = 0.5 * np.linalg.norm(turn, axis=1)
    straight = half < 1e-4  # noqa: PLR2004 - there the series' first term is exact
    safe = np.where(straight, 1.0, half)
    factor = np.where(straight, 1 / 12, (1 - safe / np.tan(safe)) / (4 * safe**2))
    once = np.cross(turn, chord)
    return chord - 0.5 * once + factor[:, None] * np.cross(turn, once), turn
