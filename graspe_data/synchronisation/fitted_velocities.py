"""Velocities of noisy poses: a parabola through some poses around each, and its slope.

A central difference of poses 0.1 s apart turns 2 cm of noise into 0.14 m/s. The slope of a parabola
through five poses has 2.2 times less noise (Savitzky and Golay, 1964), looks 0.2 s to both sides,
shifts nothing in time, and errs by a share of the third derivative alone.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from graspe_data.arrays import Floats
from graspe_data.geometry import roll_pitch_yaw, rotation_from_quaternion


def fitted_velocities(
    stamps_ns: NDArray[np.int64], positions: Floats, quaternions: Floats, poses: int = 5
) -> Floats:
    """Fit a parabola to each pose and its neighbours in time, uneven stamps included.

    Neighbours lie within ``poses / 2`` median intervals. A pose that is NaN is no neighbour and has
    NaN velocity; so has one without a neighbour. Two poses give a line.

    Args:
        stamps_ns: (N,) ns, ascending.
        positions: (N, 3) metres in a fixed frame.
        quaternions: (N, 4) x, y, z, w: the body in the fixed frame.
        poses: How many poses a fit takes, odd.

    Returns:
        float64 (N, 2): velocity along body x in m/s and yaw rate in rad/s.
    """
    velocity = np.full((stamps_ns.size, 2), np.nan)
    usable = np.isfinite(positions).all(axis=1) & np.isfinite(quaternions).all(axis=1)
    rows = np.flatnonzero(usable)
    if rows.size < 2 or stamps_ns[rows[0]] == stamps_ns[rows[-1]]:  # noqa: PLR2004
        return velocity
    # Position and unwrapped yaw over time.
    seconds = (stamps_ns[rows] - stamps_ns[rows[0]]) * 1e-9
    rotation = rotation_from_quaternion(quaternions[rows])
    yaw = np.unwrap(roll_pitch_yaw(rotation)[2])
    course = np.column_stack([positions[rows], yaw])
    # The poses within reach to both sides of each.
    reach = 0.5 * poses * float(np.median(np.diff(np.unique(seconds))))
    first = np.searchsorted(seconds, seconds - reach)
    last = np.searchsorted(seconds, seconds + reach, side="right")
    # The slope of a line through them, turned into the body's frame.
    for number, row in enumerate(rows):
        near = slice(first[number], last[number])
        slope = _slope(seconds[near] - seconds[number], course[near])
        velocity[row] = slope[:3] @ rotation[number, :, 0], slope[3]
    return velocity


def _slope(seconds: Floats, course: Floats) -> Floats:
    """The slope (D,) at zero of a parabola through ``course`` (N, D), NaN for a single time."""
    times = np.unique(seconds).size
    if times < 2:  # noqa: PLR2004
        return np.full(course.shape[1], np.nan)
    scale = np.abs(seconds).max()
    powers = np.vander(seconds / scale, min(3, times), increasing=True)
    slope: Floats = np.linalg.lstsq(powers, course, rcond=None)[0][1] / scale
    return slope
