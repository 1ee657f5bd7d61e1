"""What happens to a row by chance: sensors fail, and histories end before the anchor."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from model_zoo.augmentation.lidar_failure import LidarFailure
from model_zoo.augmentation.picture_failure import PictureFailure
from model_zoo.augmentation.settings import AugmentationSettings, LateHistorySettings


def draw_picture_failure(
    settings: AugmentationSettings, generator: np.random.Generator
) -> PictureFailure:
    """Draw what happens to a camera; always as many random numbers."""
    dark, cover = settings.darkness, settings.cover
    low, high = np.log(dark.light)
    light = math.exp(_strength(dark.probability, (low, high), 0.0, generator))
    length = _strength(settings.blur.probability, settings.blur.length, 0.0, generator)
    share = _strength(cover.probability, cover.share, 0.0, generator)
    angle, whole = generator.random(2)
    covered = 1.0 if share > 0 and whole < cover.wholly else share
    return PictureFailure(light, length, angle * math.pi, covered)


def draw_lidar_failure(
    settings: AugmentationSettings, generator: np.random.Generator
) -> LidarFailure:
    """Draw what happens to a lidar; always as many random numbers."""
    sector, half_angle = settings.sector_loss, settings.laser_scan.half_angle
    width = _strength(sector.probability, sector.width, 0.0, generator)
    thinned = _strength(settings.thinning.probability, settings.thinning.share, 0.0, generator)
    scattered = _strength(settings.scatter.probability, settings.scatter.share, 0.0, generator)
    middle, whole = generator.random(2)
    wide = 2 * math.pi if width > 0 and whole < sector.wholly else width
    return LidarFailure((2 * middle - 1) * half_angle, wide, thinned, scattered)


def mislead(
    picture: PictureFailure,
    lidar: LidarFailure,
    settings: AugmentationSettings,
    generator: np.random.Generator,
) -> tuple[PictureFailure, LidarFailure]:
    """Draw what deceives camera and lidar beside what fails of them."""
    spans = (
        (settings.droplets.probability, settings.droplets.share),
        (settings.glare.probability, settings.glare.strength),
        (settings.dust.probability, settings.dust.strength),
        (settings.near_leaves.probability, settings.near_leaves.share),
    )
    drops, glare, dust, leaves = (_strength(*span, 0.0, generator) for span in spans)
    return (
        replace(picture, droplets=drops, glare=glare),
        replace(lidar, dust=dust, near_leaves=leaves),
    )


def _strength(
    probability: float, span: tuple[float, float], otherwise: float, generator: np.random.Generator
) -> float:
    """A strength drawn evenly from a span, or what means none."""
    happens, place = generator.random(2)
    low, high = span
    return float(low + place * (high - low)) if happens < probability else otherwise


def late_history(history: Tensor, lag: NDArray[np.int64]) -> Tensor:
    """Histories (B, H, 2), oldest first, as they were so many steps before; the oldest is held.

    Args:
        history: m/s and rad/s.
        lag: Steps of the history, (B,); 0 changes nothing.
    """
    # Step i is step i - lag of the true history; before its begin the first is held.
    steps = torch.arange(history.shape[1])[None] - torch.from_numpy(lag)[:, None]
    return history.gather(1, steps.clamp(min=0)[:, :, None].expand(-1, -1, history.shape[2]))


def draw_lags(
    settings: LateHistorySettings, number: int, generator: np.random.Generator
) -> NDArray[np.int64]:
    """Steps that each of so many rows is late by, (number,); 0 for rows that are not."""
    late = generator.random(number) < settings.probability
    shortest, longest = settings.lag
    return np.where(late, generator.integers(shortest, longest, number, endpoint=True), 0)
