"""Rows seen in a mirror: left is right in every modality."""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray
from torch import Tensor

from graspe_data.observation.catalogue import BY_NAME


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
    for name, column in batch.items():
        entry = BY_NAME.get(name)
        if entry is not None and entry.mirror != "same":
            mirrored[name] = column.clone()
            _CHANGES[entry.mirror](mirrored[name], index)
    return mirrored


def _flip_pixels(pictures: Tensor, index: NDArray[np.intp]) -> None:
    values: NDArray[Any] = pictures.numpy()
    for row in index:
        picture = values[row].view(np.uint8)
        picture[:] = cv2.flip(picture, 1)


def _flip_order(column: Tensor, index: NDArray[np.intp]) -> None:
    column[index] = column[index].flip(-1)


def _negate_second(column: Tensor, index: NDArray[np.intp]) -> None:
    column[index, ..., 1] *= -1


_CHANGES = {
    "flip_pixels": _flip_pixels,
    "flip_order": _flip_order,
    "negate_second": _negate_second,
}
