"""Leaves and dirt on the lens."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from model_zoo.augmentation.camera import Light

_COARSE = (60, 80)
_BLOB = 9.0
"""Standard deviation of the smoothing that makes blobs, in cells of the 80 across."""
_SOFT = 0.12
"""Of the blobs' height over which their defocused rims fade: so near the lens nothing is sharp."""
_BISECTIONS = 12
_STRAY = 0.05
"""Of the uncovered light that shines onto the cover from inside."""
_SEEPING = 1e-4
"""Of the light that comes through the cover."""
_GREEN, _BROWN = (0.35, 1.0, 0.20), (0.90, 0.65, 0.35)


def cover_lens(light: Light, share: float, generator: np.random.Generator) -> Light:
    """The picture with a cover of random blobs, from leaf-green to earth-brown, before it.

    Args:
        light: float32 (H, W, 3), linear.
        share: Of the picture that is covered; 1 leaves nothing of it.
        generator: Draws shape and colours.
    """
    # Where the cover is: where a smooth field of noise is above what hides the share asked for.
    blobs, colour = _blobs(generator), _blobs(generator)[..., None]
    mask = _fade(blobs, _threshold(blobs[::2, ::2], share))[..., None]
    # Its colour between leaf and earth, lit by what comes in beside it and through it.
    tint = np.array(_GREEN, np.float32) * (1 - colour) + np.array(_BROWN, np.float32) * colour
    glow = float(light.mean()) * (_STRAY * (1.0 - float(mask.mean())) + _SEEPING)
    # From the coarse grid to the picture: covered light is lost, the cover's own is added.
    height, width = light.shape[:2]
    added = _fit(mask * tint * np.float32(glow), height, width)
    covered: Light = light * (1 - _fit(mask, height, width))[..., None]
    covered += added
    return covered


def _blobs(generator: np.random.Generator) -> NDArray[np.float32]:
    """Smooth noise on the coarse grid, in 0..1."""
    rough = generator.standard_normal(_COARSE, np.float32)
    smooth = cv2.GaussianBlur(rough, (0, 0), _BLOB, borderType=cv2.BORDER_REFLECT)
    low, high = float(smooth.min()), float(smooth.max())
    return np.asarray((smooth - low) / np.float32(high - low), np.float32)


def _threshold(blobs: NDArray[np.float32], share: float) -> float:
    """The height above which a cover keeps out the share of the light on average."""
    low, high = -_SOFT, 1.0 + _SOFT
    for _ in range(_BISECTIONS):
        middle = (low + high) / 2
        low, high = (middle, high) if _fade(blobs, middle).mean() > share else (low, middle)
    return low


def _fade(blobs: NDArray[np.float32], threshold: float) -> NDArray[np.float32]:
    ramp = np.clip((blobs - np.float32(threshold)) / np.float32(2 * _SOFT) + 0.5, 0.0, 1.0)
    faded: NDArray[np.float32] = ramp * ramp * (3.0 - 2.0 * ramp)
    return faded


def _fit(field: NDArray[np.float32], height: int, width: int) -> NDArray[np.float32]:
    fitted = cv2.resize(field, (width, height), interpolation=cv2.INTER_LINEAR)
    return np.asarray(fitted, np.float32)
