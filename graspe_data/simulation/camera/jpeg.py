"""Pictures as JPEG."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray


def encode_jpeg(rgb: NDArray[np.uint8], quality: int) -> bytes:
    """JPEG of a picture, uint8 (H, W, 3), RGB; quality in percent."""
    bgr = cv2.cvtColor(rgb, cv2.COLOR_RGB2BGR)
    encoded: bytes = cv2.imencode(".jpg", bgr, [cv2.IMWRITE_JPEG_QUALITY, quality])[1].tobytes()
    return encoded
