"""A picture taken of little light: automatic exposure, noise, smoothing against it."""

from __future__ import annotations

import cv2
import numpy as np

from model_zoo.augmentation.light import Light
from model_zoo.augmentation.settings import SensorSettings

_METERED_EACH = 4
_HIGHLIGHTS = 0.01
"""Share of the picture that the automatic exposure lets grow whiter than white."""
_FAINTEST_SMOOTHING = 0.2


def meter(light: Light, target: float, gain_limit: float) -> float:
    """The amplification that brings the mean of a picture to a target, within its limits.

    Args:
        light: float32 (H, W, 3), linear, 1 = white without amplification.
        target: Mean aimed at.
        gain_limit: Highest amplification.
    """
    sparse = light[::_METERED_EACH, ::_METERED_EACH].mean(axis=2)
    bright = max(float(np.quantile(sparse, 1.0 - _HIGHLIGHTS)), 1e-9)
    asked = min(target / max(float(sparse.mean()), 1e-9), 1.0 / bright)
    return float(np.clip(asked, 1.0, gain_limit))


def expose(
    light: Light, gain: float, sensor: SensorSettings, generator: np.random.Generator
) -> Light:
    """Light as a sensor reads and amplifies it, float32 (H, W, 3).

    Shot noise has the variance of the signal, reading adds its own. A normal distribution stands
    for both: where electrons are so few that Poisson's differs from it, reading's noise is larger.

    Args:
        light: float32 (H, W, 3), linear, 1 = a full well.
        gain: Amplification from electrons to the picture.
        sensor: Electrons and noise.
        generator: Draws the noise.
    """
    electrons = np.maximum(light, 0) * np.float32(sensor.full_well)
    noise = generator.standard_normal(light.shape, np.float32)
    noise *= np.sqrt(electrons + np.float32(sensor.read_noise**2))
    electrons += noise
    electrons *= np.float32(gain / sensor.full_well)
    sigma = sensor.denoising * float(np.log2(gain))
    if sigma <= _FAINTEST_SMOOTHING:
        return electrons
    return np.asarray(cv2.GaussianBlur(electrons, (0, 0), sigma), np.float32)
