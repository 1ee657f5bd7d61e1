"""Motion blur along the optical flow."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from graspe_data.arrays import Floats
from graspe_data.robot import Intrinsics

SHARP = 0.5
"""Pixels that move less than this stay as they are."""
MOST_SAMPLES = 33

Picture = NDArray[np.float32]


class OpticalFlow:
    """How the pixels of a pinhole camera move."""

    def __init__(self, intrinsics: Intrinsics) -> None:
        """Take the calibration."""
        u = np.arange(intrinsics.width, dtype=np.float32)
        v = np.arange(intrinsics.height, dtype=np.float32)
        self._focal = np.float32(intrinsics.fx)
        self._x = (u - np.float32(intrinsics.cx))[None, :] / self._focal
        self._y = (v - np.float32(intrinsics.cy))[:, None] / self._focal

    def of(self, closeness: Picture, linear: Floats, angular: Floats) -> Picture:
        """Pixels per second, float32 (H, W, 2), u and v.

        Longuet-Higgins and Prazdny 1980, of still points seen from a moving camera:
        u' = f ((x vz - vx) / Z + x y wx - (1 + x^2) wy + y wz) and
        v' = f ((y vz - vy) / Z + (1 + y^2) wx - x y wy - x wz).

        Args:
            closeness: float32 (H, W), 1 / Z in 1/m; 0 for the sky.
            linear: (3,) velocity of the camera, m/s, optical frame.
            angular: (3,) rad/s, optical frame.
        """
        x, y = self._x, self._y
        vx, vy, vz = np.asarray(linear, np.float32)
        wx, wy, wz = np.asarray(angular, np.float32)
        u = (x * vz - vx) * closeness + x * y * wx - (1 + x * x) * wy + y * wz
        v = (y * vz - vy) * closeness + (1 + y * y) * wx - x * y * wy - x * wz
        flow: Picture = np.stack([u, v], axis=2) * self._focal
        return flow


def blur_along(picture: Picture, motion: Picture) -> Picture:
    """The mean of a picture along each pixel's way during the exposure.

    Args:
        picture: float32 (H, W, 3).
        motion: float32 (H, W, 2), pixels moved in u and v during the exposure; its middle is
            where the picture shows the pixel.
    """
    longest = float(np.abs(motion).max(initial=0.0))
    if longest < SHARP:
        return picture
    count = min(MOST_SAMPLES, int(np.ceil(longest)) | 1)
    rows, columns = np.indices(motion.shape[:2], dtype=np.float32)
    total = np.zeros_like(picture)
    for share in (np.arange(count, dtype=np.float32) + 0.5) / count - 0.5:
        u, v = columns + share * motion[..., 0], rows + share * motion[..., 1]
        total += cv2.remap(picture, u, v, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    return total / np.float32(count)
