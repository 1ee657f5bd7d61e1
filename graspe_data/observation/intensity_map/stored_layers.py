"""Layers as bytes: how the dataset keeps them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

STEPS = 255
_SLACK = 1e-3


def store_layers(layers: NDArray[np.float32]) -> NDArray[np.uint8]:
    """Layers 0..1 as bytes 0..255, rounded up.

    Nothing is lost for sums and maxima of an 8-bit lidar such as the VLP-16; with float16 a row
    would be twice the size for no more. Rounding up keeps every cell that has a return apart from
    the empty ones, however faint.
    """
    scaled: NDArray[np.float32] = np.ceil(layers * np.float32(STEPS) - np.float32(_SLACK))
    return scaled.astype(np.uint8)


def restore_layers(stored: NDArray[np.uint8]) -> NDArray[np.float32]:
    """Bytes 0..255 as layers 0..1."""
    return stored.astype(np.float32) / np.float32(STEPS)
