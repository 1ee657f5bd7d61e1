"""The path of a robot that keeps its velocity."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray


def constant_velocity_arc(
    v: ArrayLike, omega: ArrayLike, steps: int = 10, step: float = 0.3
) -> NDArray[np.float64]:
    """Poses along the arc of a constant velocity, exact for every yaw rate, 0 included.

    The chord after time t has length v t sinc(omega t / 2) and direction omega t / 2.

    Args:
        v: Linear velocity (...), m/s; negative drives backwards.
        omega: Yaw rate (...), rad/s.
        steps: Poses after the first.
        step: Time between poses, s.

    Returns:
        float64 (..., steps + 1, 3): x, y in metres and yaw in rad, not wrapped, in base_link at
        the start; the first pose is 0.
    """
    times = np.arange(steps + 1) * step
    half_turn = np.multiply.outer(np.asarray(omega, np.float64), times) / 2
    length = np.multiply.outer(np.asarray(v, np.float64), times)
    chord = length * np.sinc(half_turn / np.pi)
    pose = (chord * np.cos(half_turn), chord * np.sin(half_turn), 2 * half_turn)
    return np.stack(np.broadcast_arrays(*pose), axis=-1)
