"""Gravity and the acceleration beyond it, without knowing how the sensor is mounted."""

from __future__ import annotations

import numpy as np

from graspe_data.arrays import Floats
from graspe_data.observation.labels.motion_series import InertialSeries
from graspe_data.observation.labels.moving_mean import moving_mean

# Seconds: longer than an impact or a stride, shorter than a change of slope.
GRAVITY_WINDOW_S = 2.0


def gravity(inertial: InertialSeries) -> Floats:
    """Mean acceleration over two seconds around each sample, float64 (N, 3), m/s^2.

    It stands for gravity and for steady acceleration; near zero where the sensor removes gravity.
    """
    half = GRAVITY_WINDOW_S / 2
    return moving_mean(inertial.stamps_ns, inertial.accel, half, half)


def shock(inertial: InertialSeries, window_s: float = 0.0) -> Floats:
    """Size of the acceleration less ``gravity``, float64 (N,), m/s^2.

    Args:
        inertial: The samples.
        window_s: The acceleration is first averaged, as a vector, over this window: vibration
            cancels and a push remains. Zero takes every sample as it is.
    """
    half = window_s / 2
    smooth = moving_mean(inertial.stamps_ns, inertial.accel, half, half)
    size: Floats = np.linalg.norm(smooth - gravity(inertial), axis=1)
    return size
