"""Reliability of a picture: GrASPE equations (1) and (2)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import cv2
import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from graspe_data.manifest import Settings


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
    gray = cv2.cvtColor(rgb, cv2.COLOR_RGB2GRAY)
    r_bright = float(cv2.norm(gray, cv2.NORM_L2)) / (255.0 * gray.size**0.5)
    detector = cv2.FastFeatureDetector.create(settings.fast_threshold)
    r_corners = min(1.0, len(detector.detect(gray)) / settings.saturation_corners)
    weighted = settings.brightness_weight * r_bright + settings.corner_weight * r_corners
    return ImageReliability(r_bright, r_corners, min(max(weighted, 0.0), 1.0))
