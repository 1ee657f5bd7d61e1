"""Motion blur: everything moves along a straight line while the picture is taken."""

from __future__ import annotations

import math

import cv2
import numpy as np
from numpy.typing import NDArray

from model_zoo.augmentation.light import Light

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
    middle = math.ceil(length / 2) + 1
    kernel = np.zeros((2 * middle + 1, 2 * middle + 1), np.float32)
    number = max(1, math.ceil(length * _SAMPLES))
    along = (np.arange(number) + 0.5) / number * length - length / 2
    u, v = middle + along * math.cos(angle), middle + along * math.sin(angle)
    column, row = np.floor(u).astype(np.int64), np.floor(v).astype(np.int64)
    right, below = u - column, v - row
    for down, weight_v in ((0, 1 - below), (1, below)):
        for aside, weight_u in ((0, 1 - right), (1, right)):
            np.add.at(kernel, (row + down, column + aside), weight_v * weight_u / number)
    return kernel
