"""Between the numbers of a picture and the light that made them (IEC 61966-2-1)."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

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
