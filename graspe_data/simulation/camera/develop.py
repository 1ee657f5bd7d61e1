"""From light on the sensor to the numbers of a picture."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from graspe_data.simulation.camera.exposure import Exposure, electrons_per_second
from graspe_data.simulation.camera.settings import CameraSettings

MANY = 50.0
"""Electrons from which Poisson's distribution is taken as normal."""
LEVELS = 1 << 14
TOE = 0.0031308
"""Up to this linear value the curve of sRGB is straight."""
FAINTEST_SMOOTHING = 0.2

Picture = NDArray[np.float32]


def develop(
    radiance: Picture,
    exposure: Exposure,
    settings: CameraSettings,
    generator: np.random.Generator,
) -> NDArray[np.uint8]:
    """Take a picture of light: noise, gain, clipping, smoothing against noise, sRGB's curve.

    Args:
        radiance: float32 (H, W, 3), cd/m^2 per channel.
        exposure: Time and gain.
        settings: The sensor.
        generator: Draws the noise.
    """
    scale = np.float32(electrons_per_second(settings) * exposure.time_s)
    electrons = count_electrons(radiance * scale, settings, generator)
    electrons *= np.float32(exposure.gain / settings.full_well)
    sigma = settings.denoising * float(np.log2(exposure.gain))
    smooth = cv2.GaussianBlur(electrons, (0, 0), sigma) if sigma > FAINTEST_SMOOTHING else electrons
    levels = np.clip(smooth, 0.0, 1.0) * np.float32(LEVELS - 1) + np.float32(0.5)
    picture: NDArray[np.uint8] = _srgb_curve()[levels.astype(np.uint16)]
    return picture


def count_electrons(
    mean: Picture, settings: CameraSettings, generator: np.random.Generator
) -> Picture:
    """Electrons read from pixels that hold ``mean`` on average, float32, same shape.

    Shot noise has the variance of the signal; reading adds its own; a full well holds no more.
    """
    held = np.minimum(mean, np.float32(settings.full_well))
    spread = generator.standard_normal(mean.shape, np.float32)
    few = held < MANY
    if few.any():
        read = spread[few] * np.float32(settings.read_noise)
        counted = generator.poisson(held[few]).astype(np.float32) + read
    spread *= np.sqrt(held + np.float32(settings.read_noise**2))
    spread += held
    if few.any():
        spread[few] = counted
    return np.minimum(spread, np.float32(settings.full_well), out=spread)


def _srgb_curve() -> NDArray[np.uint8]:
    """IEC 61966-2-1 at the sensor's levels."""
    linear = np.linspace(0.0, 1.0, LEVELS)
    curve = np.where(linear <= TOE, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
    return np.rint(255.0 * curve).astype(np.uint8)


def encode_jpeg(rgb: NDArray[np.uint8], quality: int) -> bytes:
    """JPEG of a picture, uint8 (H, W, 3), RGB; quality in percent."""
    bgr = cv2.cvtColor(rgb, cv2.COLOR_RGB2BGR)
    encoded: bytes = cv2.imencode(".jpg", bgr, [cv2.IMWRITE_JPEG_QUALITY, quality])[1].tobytes()
    return encoded
