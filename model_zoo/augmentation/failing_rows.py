"""Batches of which sensors fail: the columns they reach, and the reliabilities, computed anew."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray
from torch import Tensor

from graspe_data.observation.catalogue import PER_POINT
from graspe_data.observation.observe import rate_picture, rate_points
from model_zoo.augmentation.lidar_failure import (
    LidarFailure,
    lose_points,
    lose_rays,
    scattered_smoothness,
)
from model_zoo.augmentation.picture_failure import PictureFailure, retake
from model_zoo.augmentation.settings import AugmentationSettings

OF_IMAGE = ("r_bright", "r_corners", "r_img")
OF_POINTS = ("r_edge", "r_planar", "r_point")

_PICTURE, _POINTS, _SCAN = 2, 3, 4
"""Last words of the keys of what is drawn for each; 1 is whoever draws the failures."""

Arrays = dict[str, NDArray[Any]]


@dataclass(frozen=True)
class RowFailure:
    """What happens to the sensors of one row.

    Attributes:
        key: Words that seed what is drawn; columns do not share draws, so that one is degraded
            alike whatever others a batch has.
        picture: What happens to the camera.
        lidar: What happens to the lidar.
    """

    key: tuple[int, int, int]
    picture: PictureFailure = field(default_factory=PictureFailure)
    lidar: LidarFailure = field(default_factory=LidarFailure)

    def generator(self, word: int) -> np.random.Generator:
        """The generator of one column."""
        return np.random.default_rng([*self.key, word])


def fail_rows(
    batch: dict[str, Tensor], failures: Sequence[RowFailure], settings: AugmentationSettings
) -> dict[str, Tensor]:
    """Degrade rows of a batch.

    Args:
        batch: Columns of B rows, on the CPU; not changed.
        failures: What happens to each row.
        settings: The sensor and the reliabilities.

    Returns:
        The batch; columns that nothing happened to are the same tensors.
    """
    failed = dict(batch)
    pictures = [row for row, failure in enumerate(failures) if not failure.picture.nothing]
    clouds = [row for row, failure in enumerate(failures) if not failure.lidar.nothing]
    if pictures and "image" in batch:
        columns = _copy(failed, ("image", *OF_IMAGE))
        for row in pictures:
            _fail_picture(columns, row, failures[row], settings)
    if clouds and {"points", "point_count"} <= batch.keys():
        columns = _copy(failed, (*PER_POINT, "point_count", *OF_POINTS))
        for row in clouds:
            _fail_points(columns, row, failures[row], settings)
    if clouds and "laser_scan" in batch:
        scans = _copy(failed, ("laser_scan",))["laser_scan"]
        for row in clouds:
            failure, generator = failures[row].lidar, failures[row].generator(_SCAN)
            scans[row] = lose_rays(scans[row], failure, settings.laser_scan, generator)
    return failed


def _copy(batch: dict[str, Tensor], names: Iterable[str]) -> Arrays:
    """Replace columns of a batch by copies, and view these as arrays."""
    present = [name for name in names if name in batch]
    batch.update({name: batch[name].clone() for name in present})
    return {name: batch[name].numpy() for name in present}


def _fail_picture(
    columns: Arrays, row: int, failure: RowFailure, settings: AugmentationSettings
) -> None:
    image = columns["image"][row]
    image[:] = retake(image, failure.picture, settings.sensor, failure.generator(_PICTURE))
    if not columns.keys().isdisjoint(OF_IMAGE):
        _put(columns, row, rate_picture(image, settings.image_reliability))


def _fail_points(
    columns: Arrays, row: int, failure: RowFailure, settings: AugmentationSettings
) -> None:
    count = int(columns["point_count"][row])
    generator = failure.generator(_POINTS)
    left = lose_points(columns["points"][row, :count], failure.lidar, generator)
    index = left.index
    for column in (columns[name] for name in PER_POINT if name in columns):
        column[row, : len(index)] = column[row, index]
        column[row, len(index) :] = np.nan
    columns["points"][row, : len(index)] *= left.way[:, None]
    if "intensity" in columns:
        columns["intensity"][row, : len(index)] *= left.brightness
    columns["point_count"][row] = len(index)
    if "smoothness" in columns:
        smoothness = columns["smoothness"][row]
        smoothness[: len(index)] = scattered_smoothness(smoothness[: len(index)], left, generator)
        rated = smoothness, columns["points"][row], len(index)
        _put(columns, row, rate_points(*rated, settings.point_reliability))


def _put(columns: Arrays, row: int, values: dict[str, float]) -> None:
    for name in values.keys() & columns.keys():
        columns[name][row] = values[name]
