"""Automatic exposure: how long, and how much amplified, a picture is taken."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from graspe_data.simulation.camera.settings import CameraSettings

METERED_EACH = 4
BISECTIONS = 24


@dataclass(frozen=True)
class Exposure:
    """Time in s; amplification from electrons to the picture, 1 or more."""

    time_s: float
    gain: float


def electrons_per_second(settings: CameraSettings) -> float:
    """Electrons of a pixel in a second per cd/m^2.

    Illuminance of the sensor: E = pi L / (4 N^2) at an f-number of N.
    """
    return float(np.pi / (4.0 * settings.f_number**2) * settings.sensitivity)


def meter(radiance: NDArray[np.float32], settings: CameraSettings) -> Exposure:
    """The exposure that brings the mean of the clipped linear picture to the target grey.

    It stays shorter where else more than the allowed share of highlights would be lost.
    A longer exposure is preferred to a higher gain; both have limits. It depends on this picture
    only, as if the camera had had time to settle.

    Args:
        radiance: float32 (H, W, 3), cd/m^2 per channel.
        settings: The target and the limits.
    """
    sparse = radiance[::METERED_EACH, ::METERED_EACH].mean(axis=2)
    whites = sparse.astype(np.float64) * electrons_per_second(settings) / settings.full_well
    longest = settings.exposure_limit * settings.gain_limit
    bright = max(float(np.quantile(whites, 1.0 - settings.highlights)), 1e-12)
    needed = min(_mean_to(settings.target_grey, whites, longest), 1.0 / bright)
    time_s = min(needed, settings.exposure_limit)
    return Exposure(time_s, float(np.clip(needed / time_s, 1.0, settings.gain_limit)))


def _mean_to(target: float, whites: NDArray[np.float64], longest: float) -> float:
    """The factor, at most ``longest``, at which the clipped mean is the target."""
    low, high = np.log(longest) - 20.0, np.log(longest)
    for _ in range(BISECTIONS):
        middle = (low + high) / 2
        bright = np.minimum(whites * np.exp(middle), 1.0).mean() > target
        low, high = (low, middle) if bright else (middle, high)
    return float(np.exp(high))
