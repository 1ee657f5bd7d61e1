"""Rows seen in a mirror: left is right in every modality."""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray
from torch import Tensor

_PICTURES = ("image", "trajectory_image")
_CANDIDATES = "candidate_image"


def mirror(batch: dict[str, Tensor], rows: NDArray[np.bool_] | Tensor) -> dict[str, Tensor]:
    """Mirror rows of a batch about the plane in which the robot drives straight on.

    Pictures are mirrored about their own middle: a camera whose principal point lies off it, or
    which is not mounted in that plane, sees the mirrored world from as far on the other side.
    Labels have no side, reliabilities do not change.

    Args:
        batch: Columns of B rows, on the CPU; not changed.
        rows: bool (B,), which.

    Returns:
        The batch; columns that have no side are the same tensors.
    """
    index = np.flatnonzero(np.asarray(rows))
    mirrored = dict(batch)
    if not len(index):
        return mirrored
    for name in _PICTURES:
        if name in batch:
            mirrored[name] = batch[name].clone()
            _flip(mirrored[name].numpy(), index)
    if _CANDIDATES in batch:
        mirrored[_CANDIDATES] = batch[_CANDIDATES].clone()
        mirrored[_CANDIDATES][index] = batch[_CANDIDATES][index].flip(-1)
    if "points" in batch:
        mirrored["points"] = _negated(batch["points"], index, component=1)
    if "velocity_history" in batch:
        mirrored["velocity_history"] = _negated(batch["velocity_history"], index, component=1)
    if "laser_scan" in batch:
        mirrored["laser_scan"] = batch["laser_scan"].clone()
        mirrored["laser_scan"][index] = batch["laser_scan"][index].flip(-1)
    return mirrored


def _flip(pictures: NDArray[Any], index: NDArray[np.intp]) -> None:
    for row in index:
        picture = pictures[row].view(np.uint8)
        picture[:] = cv2.flip(picture, 1)


def _negated(column: Tensor, index: NDArray[np.intp], component: int) -> Tensor:
    negated = column.clone()
    negated[index, ..., component] *= -1
    return negated
