"""Augmentation of training batches, and the columns that it reads."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np
from torch import Tensor

from graspe_data.errors import ZooError
from graspe_data.observation.catalogue import PER_POINT
from model_zoo.augmentation.draw import (
    draw_lags,
    draw_lidar_failure,
    draw_picture_failure,
    late_history,
    mislead,
)
from model_zoo.augmentation.failing_rows import (
    OF_IMAGE,
    OF_POINTS,
    RowFailure,
    fail_rows,
)
from model_zoo.augmentation.mirror import mirror
from model_zoo.augmentation.reliability import give_reliabilities
from model_zoo.augmentation.settings import AugmentationSettings

_SEEN = ("image", "trajectory_image", "laser_scan", "velocity_history", "point_count")
_VALID = ("image_valid", "points_valid", "odometry_valid")
_KNOWN = (*_SEEN, *PER_POINT, *OF_IMAGE, *OF_POINTS, *_VALID)
"""What ``fail_rows`` changes, or may leave. The catalogue knows how a column looks in a mirror, and
this module how it looks when a sensor fails: a new one is refused until it is here."""


def augment(
    batch: dict[str, Tensor], settings: AugmentationSettings, seed: int, step: int
) -> dict[str, Tensor]:
    """Mirror rows of a batch, let sensors fail and histories end early, by chance.

    What happens is a function of seed, step and the row's place in the batch, whichever columns
    there are: ranks that share a step need seeds of their own. Only columns that are in the batch
    are changed. After a failure the reliabilities are computed as the dataset's were: those of the
    picture from ``image``, those of the cloud from the ``smoothness`` of the points that are left;
    without these columns they stay as they are.

    Args:
        batch: Columns of B rows as they lie in a dataset, on the CPU; not changed.
        settings: How often and how badly.
        seed: Of the run, 0 or more.
        step: Of the run, 0 or more.
    """
    number = len(next(iter(batch.values()), ()))
    mirrored = np.random.default_rng([seed, step, 0, 1]).random(number) < settings.mirror
    failures = [_draw(settings, (seed, step, row + 1)) for row in range(number)]
    failed = fail_rows(batch, failures, settings)
    failed = give_reliabilities(failed, settings.reliability, failures, [seed, step, 0, 3])
    lags = draw_lags(settings.late_history, number, np.random.default_rng([seed, step, 0, 2]))
    if "velocity_history" in failed and lags.any():
        failed = failed | {"velocity_history": late_history(failed["velocity_history"], lags)}
    return mirror(failed, mirrored)


def columns_needed(
    model_columns: Collection[str], offered: Collection[str] | None = None
) -> tuple[str, ...]:
    """The columns to load so that a model's batches can be augmented: its own first.

    Reliabilities are computed from ``image``, and from ``points`` and ``smoothness``; points are
    counted by ``point_count``.

    Args:
        model_columns: What the model reads.
        offered: What the dataset has: of the columns that are added here, those it lacks are left
            out. It may lack ``smoothness``: see ``check_lidar_may_fail``.

    Raises:
        ZooError: The model reads a column of which it is not known how it looks in a mirror.
    """
    if unknown := sorted(set(model_columns) - set(_KNOWN)):
        raise ZooError(
            f"augmentation: it is not known how {', '.join(unknown)} looks in a mirror or when a "
            f"sensor fails; known are {', '.join(sorted(_KNOWN))}. Train without augmentation."
        )
    added: list[str] = []
    if not set(OF_IMAGE).isdisjoint(model_columns):
        added += ["image"]
    if not set(OF_POINTS).isdisjoint(model_columns):
        added += ["points", "point_count", "smoothness"]
    if not set(PER_POINT).isdisjoint(model_columns):
        added += ["points", "point_count"]
    kept = [name for name in added if offered is None or name in offered]
    return tuple(dict.fromkeys((*model_columns, *kept)))


def check_lidar_may_fail(
    model_columns: Collection[str], offered: Collection[str], where: str, otherwise: str
) -> None:
    """Refuse a dataset that cannot tell how reliable a cloud is of which returns are lost.

    Args:
        model_columns: What the model reads.
        offered: What the dataset has.
        where: Of the dataset, for the error.
        otherwise: What else can be done about it.

    Raises:
        ZooError: The model reads r_point, and the dataset has no ``smoothness``.
    """
    if set(OF_POINTS).isdisjoint(model_columns) or "smoothness" in offered:
        return
    raise ZooError(
        f"{where}: no column smoothness. The model reads r_point, which is computed anew from it "
        f"where the lidar fails. Put smoothness into storage.optional_columns of the dataset's "
        f"manifest and build again, or {otherwise}."
    )


def _draw(settings: AugmentationSettings, key: tuple[int, int, int]) -> RowFailure:
    generator = np.random.default_rng([*key, 1])
    picture = draw_picture_failure(settings, generator)
    lidar = draw_lidar_failure(settings, generator)
    return RowFailure(key, *mislead(picture, lidar, settings, generator))
