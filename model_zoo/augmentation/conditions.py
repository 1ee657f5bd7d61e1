"""Failures of a fixed strength, under which models are evaluated."""

from __future__ import annotations

import math
from typing import Literal, get_args

import numpy as np
from torch import Tensor

from graspe_data.errors import ZooError
from model_zoo.augmentation.failing_rows import RowFailure, fail_rows
from model_zoo.augmentation.lidar_failure import LidarFailure
from model_zoo.augmentation.picture_failure import PictureFailure
from model_zoo.augmentation.reliability import give_reliabilities
from model_zoo.augmentation.settings import AugmentationSettings

Condition = Literal["clean", "dark", "blurred", "covered", "lidar_sector_lost"]
CONDITIONS: tuple[Condition, ...] = get_args(Condition)

_DARK_LIGHT = 0.004
"""As dark as pictures at some lux with the exposure at its limit: r_bright about 0.07."""
_BLUR_LENGTH = 20 / 320
"""Of the picture's width."""
_COVERED_SHARE = 0.9
_SECTOR_WIDTH = math.pi / 2
_WORDS = (1 << 64) - 1


def apply_condition(
    batch: dict[str, Tensor],
    condition: Condition,
    seed: int,
    settings: AugmentationSettings | None = None,
) -> dict[str, Tensor]:
    """Let a sensor of every row fail in the same way.

    ``dark`` leaves 0.4 % of the light; ``blurred`` moves the picture by a sixteenth of its width;
    ``covered`` hides nine tenths of the lens; ``lidar_sector_lost`` loses a right angle of points
    and scan. Direction, shape and place are drawn for each row from its ``stamp_ns``, so that they
    do not depend on batches, or from its place in this call where that column is not there.
    Reliabilities follow as in training, see ``augment``.

    Args:
        batch: Columns of B rows as they lie in a dataset, on the CPU; not changed.
        condition: One of :data:`CONDITIONS`.
        seed: Of the evaluation, 0 or more.
        settings: Its sensor, scan and reliabilities count here, not its probabilities.

    Raises:
        ZooError: No such condition.
    """
    if condition not in CONDITIONS:
        raise ZooError(f"no condition {condition!r}: known are {', '.join(CONDITIONS)}.")
    settings = settings or AugmentationSettings()
    width = batch["image"].shape[2] if "image" in batch else 0
    keys = [(seed, name, CONDITIONS.index(condition)) for name in _names(batch)]
    failures = [_failure(condition, key, width, settings.laser_scan.half_angle) for key in keys]
    failed = fail_rows(batch, failures, settings)
    key = [seed, CONDITIONS.index(condition), *keys[0]] if keys else [seed]
    return give_reliabilities(failed, settings.reliability, failures, key)


def _names(batch: dict[str, Tensor]) -> list[int]:
    """A number, 0 or more, for each row."""
    if "stamp_ns" in batch:
        return [int(stamp) & _WORDS for stamp in batch["stamp_ns"].tolist()]
    return list(range(len(next(iter(batch.values()), ()))))


def _failure(
    condition: Condition, key: tuple[int, int, int], width: int, half_angle: float
) -> RowFailure:
    if condition == "clean":
        return RowFailure(key)
    chance = float(np.random.default_rng([*key, 1]).random())
    if condition == "dark":
        return RowFailure(key, PictureFailure(light=_DARK_LIGHT))
    if condition == "blurred":
        return RowFailure(key, PictureFailure(1.0, _BLUR_LENGTH * width, chance * math.pi))
    if condition == "covered":
        return RowFailure(key, PictureFailure(covered=_COVERED_SHARE))
    middle = (2 * chance - 1) * max(half_angle - _SECTOR_WIDTH / 2, 0.0)
    return RowFailure(key, lidar=LidarFailure(middle, _SECTOR_WIDTH))
