"""Reliability of a picture: GrASPE equations (1) and (2)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import cv2
import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from graspe_data.manifest import Settings

_BAND = 40
_REACH = 4
"""Rows to each side of a pixel that decide: three for FAST's circle, one for its rivals."""


class ImageReliabilitySettings(Settings):
    """Weights of equation (2), the corner count that saturates it, FAST's threshold in grey."""

    brightness_weight: Annotated[float, Field(ge=0, le=1000)] = 0.5
    corner_weight: Annotated[float, Field(ge=0, le=1000)] = 0.5
    saturation_corners: Annotated[int, Field(gt=0, le=1_000_000)] = 1000
    fast_threshold: Annotated[int, Field(gt=0, lt=256)] = 10


@dataclass(frozen=True)
class ImageReliability:
    """Brightness, corners and their weighted sum, each in 0..1."""

    r_bright: float
    r_corners: float
    r_img: float


def image_reliability(
    rgb: NDArray[np.uint8], settings: ImageReliabilitySettings
) -> ImageReliability:
    """Reliability of a picture from its brightness and its FAST corners.

    Equation (1): r_bright is the root mean square grey value over 255. The printed form, the root
    mean square of the histogram's counts, is highest for a black picture.
    Equation (2): r_img = alpha_b r_bright + alpha_c r_corners, clipped to 0..1, where
    r_corners = min(1, n_c / n_sat) saturates.

    Args:
        rgb: uint8 (H, W, 3), of the size the dataset stores: the count of corners depends on it.
        settings: Weights and thresholds.
    """
    gray = np.asarray(cv2.cvtColor(rgb, cv2.COLOR_RGB2GRAY), np.uint8)
    r_bright = float(cv2.norm(gray, cv2.NORM_L2)) / (255.0 * gray.size**0.5)
    corners = _count_corners(gray, settings.fast_threshold, settings.saturation_corners)
    r_corners = min(1.0, corners / settings.saturation_corners)
    weighted = settings.brightness_weight * r_bright + settings.corner_weight * r_corners
    return ImageReliability(r_bright, r_corners, min(max(weighted, 0.0), 1.0))


def _count_corners(gray: NDArray[np.uint8], threshold: int, enough: int) -> int:
    """Count FAST corners band by band from the bottom, on the ground, until there are enough."""
    detector = cv2.FastFeatureDetector.create(threshold)
    found, below = 0, len(gray)
    while below > 0 and found < enough:
        above = max(0, below - _BAND)
        first = max(0, above - _REACH)
        band = gray[first : below + _REACH]
        own = np.zeros_like(band)
        own[above - first : below - first] = 1
        found += len(detector.detect(band, own))
        below = above
    return found
