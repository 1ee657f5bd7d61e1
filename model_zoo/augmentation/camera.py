"""How a camera takes a picture: light and its numbers, motion blur, exposure and noise."""

from __future__ import annotations

import math

import cv2
import numpy as np
from numpy.typing import NDArray

from model_zoo.augmentation.settings import ExposureSettings

Light = NDArray[np.float32]

_LEVELS = 1 << 14
_TOE = 0.04045
"""Up to this value of the picture the curve is straight."""


def _to_linear(value: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.where(value <= _TOE, value / 12.92, ((value + 0.055) / 1.055) ** 2.4)


_LINEAR = _to_linear(np.arange(256) / 255).astype(np.float32)
_NEAREST = np.searchsorted(
    _to_linear((np.arange(255) + 0.5) / 255), np.arange(_LEVELS) / (_LEVELS - 1)
).astype(np.uint8)


def light_of(picture: NDArray[np.uint8]) -> Light:
    """Light of each pixel, float32 (H, W, 3), 1 = white, of an sRGB picture uint8 (H, W, 3)."""
    return np.asarray(cv2.LUT(picture, _LINEAR), np.float32)


def picture_of(light: Light) -> NDArray[np.uint8]:
    """The sRGB picture, uint8 (H, W, 3), of light; clipped at black and white."""
    levels = (light * np.float32(_LEVELS - 1) + np.float32(0.5)).astype(np.int32)
    picture: NDArray[np.uint8] = _NEAREST.take(levels, mode="clip")
    return picture


_SAMPLES = 4
"""Points of the line per pixel."""


def motion_blur(light: Light, length: float, angle: float) -> Light:
    """The mean of a picture along a line.

    Args:
        light: float32 (H, W, 3), linear.
        length: Of the line, pixels.
        angle: Between the line and the picture's rows, rad.
    """
    kernel = _line(length, angle)
    blurred = cv2.filter2D(light, -1, kernel, borderType=cv2.BORDER_REPLICATE)
    return np.asarray(blurred, np.float32)


def _line(length: float, angle: float) -> NDArray[np.float32]:
    """A line through the middle of an odd square, its points shared among four pixels each."""
    # A square with room for the line at any angle, and for the neighbours of its ends.
    middle = math.ceil(length / 2) + 1
    kernel = np.zeros((2 * middle + 1, 2 * middle + 1), np.float32)
    # Points evenly along the line, from the middle of the first part to that of the last.
    number = max(1, math.ceil(length * _SAMPLES))
    along = (np.arange(number) + 0.5) / number * length - length / 2
    u, v = middle + along * math.cos(angle), middle + along * math.sin(angle)
    # Each point gives to the four pixels around it by how near it is to them.
    column, row = np.floor(u).astype(np.int64), np.floor(v).astype(np.int64)
    right, below = u - column, v - row
    for down, weight_v in ((0, 1 - below), (1, below)):
        for aside, weight_u in ((0, 1 - right), (1, right)):
            np.add.at(kernel, (row + down, column + aside), weight_v * weight_u / number)
    return kernel


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
    # A pixel in sixteen is enough for a mean and a quantile.
    sparse = light[::_METERED_EACH, ::_METERED_EACH].mean(axis=2)
    bright = max(float(np.quantile(sparse, 1.0 - _HIGHLIGHTS)), 1e-9)
    # What the mean needs, but no more than leaves the highlights below white.
    gain = min(target / max(float(sparse.mean()), 1e-9), 1.0 / bright)
    return float(np.clip(gain, 1.0, gain_limit))


def expose(
    light: Light, gain: float, sensor: ExposureSettings, generator: np.random.Generator
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
    # Electrons, with the shot noise of their number and the noise of reading them.
    electrons = np.maximum(light, 0) * np.float32(sensor.full_well)
    noise = generator.standard_normal(light.shape, np.float32)
    noise *= np.sqrt(electrons + np.float32(sensor.read_noise**2))
    electrons += noise
    # Amplified into the picture, and smoothed the more the higher the gain.
    electrons *= np.float32(gain / sensor.full_well)
    sigma = sensor.denoising * float(np.log2(gain))
    if sigma <= _FAINTEST_SMOOTHING:
        return electrons
    return np.asarray(cv2.GaussianBlur(electrons, (0, 0), sigma), np.float32)
