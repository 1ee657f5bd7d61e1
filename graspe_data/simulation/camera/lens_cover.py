"""Leaves and dirt on the lens."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

COARSE = (60, 80)
WIDTH = 9.0
"""Standard deviation of the smoothing that makes blobs, in cells of the 80 across."""
SOFT = 0.12
"""Of the blobs' height over which their defocused rims fade."""
STRAY = 0.05
"""Of the uncovered light that shines onto the cover from inside."""
SEEPING = 1e-4
"""Of the light that comes through the cover."""
GREEN, BROWN = (0.35, 1.0, 0.20), (0.90, 0.65, 0.35)

Picture = NDArray[np.float32]


@dataclass(frozen=True)
class LensCover:
    """What covers the lens while an episode lasts.

    ``share``: of the picture that is covered, 0..1. ``seed``: of the shape.
    """

    share: float
    seed: int = 0

    def __post_init__(self) -> None:
        """Refuse a share that is none."""
        if not 0.0 <= self.share <= 1.0:
            raise ValueError(f"share of the lens that is covered: {self.share:g} is not in 0..1")


def covered_share(cover: LensCover, height: int, width: int) -> Picture:
    """How much of each pixel's light is kept out, float32 (H, W), 0..1.

    The mean is the share that the cover asks for. So near the lens nothing has an edge.
    """
    field = _blobs(np.random.default_rng([cover.seed, 0]))
    soft = _fade(field, _threshold(field, cover.share))
    return _fit(soft, height, width)


def cover_lens(radiance: Picture, cover: LensCover, mask: Picture) -> Picture:
    """The picture with the cover before it, float32 (H, W, 3), cd/m^2 per channel.

    Args:
        radiance: float32 (H, W, 3), without the cover.
        cover: Its seed gives the colours.
        mask: ``covered_share`` of it.
    """
    height, width = mask.shape
    brown = _fit(_blobs(np.random.default_rng([cover.seed, 1])), height, width)[..., None]
    tint = np.array(GREEN, np.float32) * (1 - brown) + np.array(BROWN, np.float32) * brown
    light = float(radiance.mean()) * (STRAY * (1.0 - float(mask.mean())) + SEEPING)
    kept: Picture = radiance + mask[..., None] * (tint * np.float32(light) - radiance)
    return kept


def _blobs(generator: np.random.Generator) -> Picture:
    """Smooth noise over the picture, in 0..1."""
    rough = generator.standard_normal(COARSE, np.float32)
    smooth = cv2.GaussianBlur(rough, (0, 0), WIDTH, borderType=cv2.BORDER_REFLECT)
    low, high = float(smooth.min()), float(smooth.max())
    blobs: Picture = (smooth - low) / np.float32(high - low)
    return blobs


def _fit(field: Picture, height: int, width: int) -> Picture:
    fitted = cv2.resize(field, (width, height), interpolation=cv2.INTER_LINEAR)
    return np.asarray(fitted, np.float32)


def _threshold(field: Picture, share: float) -> float:
    low, high = -SOFT, 1.0 + SOFT
    for _ in range(24):
        middle = (low + high) / 2
        low, high = (middle, high) if _fade(field, middle).mean() > share else (low, middle)
    return (low + high) / 2


def _fade(field: Picture, threshold: float) -> Picture:
    ramp = np.clip((field - threshold) / SOFT * 0.5 + 0.5, 0.0, 1.0)
    faded: Picture = (ramp * ramp * (3.0 - 2.0 * ramp)).astype(np.float32)
    return faded
