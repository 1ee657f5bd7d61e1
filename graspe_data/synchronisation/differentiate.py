"""Velocities from poses, where a recording holds no twist."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from graspe_data.geometry import roll_pitch_yaw

Floats = NDArray[np.float64]


def body_velocities(
    stamps_ns: NDArray[np.int64], positions: Floats, rotations: Floats
) -> tuple[Floats, Floats]:
    """Differentiate poses by central differences, second order also for uneven stamps.

    Of poses with one stamp, the first counts and gives the velocity of all. A pose that is not
    finite is left out, and its velocity is NaN; so are all where fewer than two stamps are usable.
    The order of the poses does not matter.

    Args:
        stamps_ns: (N,) ns.
        positions: (N, 3) metres in a fixed frame.
        rotations: (N, 3, 3) of the body in the fixed frame.

    Returns:
        Velocity along body x in m/s and yaw rate in rad/s, each float64 (N,).
    """
    linear, yaw_rate = np.full(stamps_ns.size, np.nan), np.full(stamps_ns.size, np.nan)
    usable = np.isfinite(positions).all(axis=1) & np.isfinite(rotations).all(axis=(1, 2))
    unique, first, inverse = np.unique(stamps_ns[usable], return_index=True, return_inverse=True)
    if unique.size > 1:
        seconds = (unique - unique[0]) * 1e-9
        rotation = rotations[usable][first]
        velocity = np.gradient(positions[usable][first], seconds, axis=0)
        yaw = np.unwrap(roll_pitch_yaw(rotation)[2])
        forward = rotation[:, :, 0]
        linear[usable] = np.einsum("ij,ij->i", velocity, forward)[inverse]
        yaw_rate[usable] = np.gradient(yaw, seconds)[inverse]
    return linear, yaw_rate
