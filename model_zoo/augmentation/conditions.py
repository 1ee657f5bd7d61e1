"""Failures of a fixed strength, under which models are evaluated."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Literal, get_args

import numpy as np
from torch import Tensor

from graspe_data.errors import ZooError
from graspe_data.observation.catalogue import PER_POINT
from model_zoo.augmentation.failing_rows import OF_IMAGE, OF_POINTS, RowFailure, fail_rows
from model_zoo.augmentation.lidar_failure import LidarFailure
from model_zoo.augmentation.picture_failure import PictureFailure
from model_zoo.augmentation.reliability import give_reliabilities
from model_zoo.augmentation.settings import AugmentationSettings

Condition = Literal[
    "clean",
    "dark",
    "blurred",
    "covered",
    "lidar_sector_lost",
    "half_covered",
    "droplets",
    "glare",
    "thinned",
    "dust",
    "near_leaves",
    "strange_camera",
    "strange_lidar",
]
CONDITIONS: tuple[Condition, ...] = (
    "clean",
    "dark",
    "blurred",
    "covered",
    "lidar_sector_lost",
)
"""Those that models are evaluated under, where nothing else is asked."""
KNOWN_CONDITIONS: tuple[Condition, ...] = get_args(Condition)
FAILING_SENSOR: Mapping[Condition, Literal["camera", "lidar"]] = {
    "dark": "camera",
    "blurred": "camera",
    "covered": "camera",
    "half_covered": "camera",
    "droplets": "camera",
    "glare": "camera",
    "lidar_sector_lost": "lidar",
    "thinned": "lidar",
    "dust": "lidar",
    "near_leaves": "lidar",
    "strange_camera": "camera",
    "strange_lidar": "lidar",
}
_OF_SENSOR: Mapping[Condition, tuple[str, ...]] = {
    "strange_camera": ("image", *OF_IMAGE),
    "strange_lidar": (*PER_POINT, "point_count", "laser_scan", *OF_POINTS),
}
"""What comes from another scene."""

_STRENGTHS: Mapping[Condition, PictureFailure | LidarFailure] = {
    # As dark as pictures at some lux with the exposure at its limit: r_bright about 0.07.
    "dark": PictureFailure(light=0.004),
    "covered": PictureFailure(covered=0.9),
    "half_covered": PictureFailure(covered=0.5),
    "droplets": PictureFailure(droplets=0.6),
    "glare": PictureFailure(glare=1.0),
    "thinned": LidarFailure(thinned=0.7),
    "dust": LidarFailure(dust=1.0),
    "near_leaves": LidarFailure(near_leaves=0.6),
}
_BLUR_LENGTH = 20 / 320
"""Of the picture's width."""
_SECTOR_WIDTH = math.pi / 2
_WORDS = (1 << 64) - 1


def chosen_conditions(names: Sequence[str] | None = None) -> tuple[Condition, ...]:
    """Conditions by their names; None chooses :data:`CONDITIONS`, and ``all`` every one.

    Raises:
        ZooError: None is named, one twice, or one that is not known.
    """
    if names is None:
        return CONDITIONS
    if list(names) == ["all"]:
        return KNOWN_CONDITIONS
    chosen = tuple(known for name in names for known in KNOWN_CONDITIONS if known == name)
    if not chosen or len(chosen) < len(names) or len(set(chosen)) < len(chosen):
        raise ZooError(
            f"conditions: found {', '.join(names) or 'none'}; give one or more, once each, of "
            f"{', '.join(KNOWN_CONDITIONS)}."
        )
    return chosen


def apply_condition(
    batch: dict[str, Tensor],
    condition: Condition,
    seed: int,
    settings: AugmentationSettings | None = None,
) -> dict[str, Tensor]:
    """Let a sensor of every row fail in the same way.

    ``dark`` leaves 0.4 % of the light; ``blurred`` moves the picture by a sixteenth of its width;
    ``covered`` hides nine tenths of the lens, ``half_covered`` half; ``droplets`` lie on six tenths
    of it; ``glare`` is the sun in it. ``lidar_sector_lost`` loses a right angle of points and scan,
    ``thinned`` seven tenths of the returns here and there; ``dust`` is puffs that return beams, and
    ``near_leaves`` hide six tenths of what is ahead. ``strange_camera`` and ``strange_lidar`` take
    all that a sensor says from the row half a batch further: another scene.

    Direction, shape and place are drawn for each row from its ``stamp_ns``, so that they do not
    depend on batches, or from its place in this call where that column is not there. Reliabilities
    follow as in training, see ``augment``.

    Args:
        batch: Columns of B rows as they lie in a dataset, on the CPU; not changed.
        condition: One of :data:`KNOWN_CONDITIONS`.
        seed: Of the evaluation, 0 or more.
        settings: Its sensor, scan and reliabilities count here, not its probabilities.

    Raises:
        ZooError: No such condition.
    """
    if condition not in KNOWN_CONDITIONS:
        raise ZooError(f"no condition {condition!r}: known are {', '.join(KNOWN_CONDITIONS)}.")
    settings = settings or AugmentationSettings()
    if condition in _OF_SENSOR:
        return _strange(batch, condition, settings)
    width = batch["image"].shape[2] if "image" in batch else 0
    keys = [(seed, name, KNOWN_CONDITIONS.index(condition)) for name in _names(batch)]
    failures = [_failure(condition, key, width, settings.laser_scan.half_angle) for key in keys]
    failed = fail_rows(batch, failures, settings)
    key = [seed, KNOWN_CONDITIONS.index(condition), *keys[0]] if keys else [seed]
    return give_reliabilities(failed, settings.reliability, failures, key)


def _strange(
    batch: dict[str, Tensor], condition: Condition, settings: AugmentationSettings
) -> dict[str, Tensor]:
    """The batch with one sensor's columns of other rows; of a single row there is no other."""
    names = [name for name in _OF_SENSOR[condition] if name in batch]
    rows = len(next(iter(batch.values()), ()))
    others = batch | {name: batch[name].roll(rows // 2, 0) for name in names}
    blind = RowFailure((0, 0, 0), PictureFailure(covered=1.0))
    deaf = RowFailure((0, 0, 0), lidar=LidarFailure(sector_width=1.0))
    failures = [blind if FAILING_SENSOR[condition] == "camera" else deaf] * rows
    return give_reliabilities(others, settings.reliability, failures, [0])


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
    if condition in _STRENGTHS:
        failure = _STRENGTHS[condition]
        if isinstance(failure, PictureFailure):
            return RowFailure(key, failure)
        return RowFailure(key, lidar=failure)
    chance = float(np.random.default_rng([*key, 1]).random())
    if condition == "blurred":
        return RowFailure(key, PictureFailure(1.0, _BLUR_LENGTH * width, chance * math.pi))
    middle = (2 * chance - 1) * max(half_angle - _SECTOR_WIDTH / 2, 0.0)
    return RowFailure(key, lidar=LidarFailure(middle, _SECTOR_WIDTH))
