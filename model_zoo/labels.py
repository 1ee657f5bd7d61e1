"""The labels of a whole split, which are few bytes a row."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from graspe_data.errors import ZooError
from graspe_data.shards import Dataset
from model_zoo.resampling import rows_with_failure

UNJUDGED = (
    "The driven path leaves the predicted one, the odometry has gaps, or failures that nobody "
    "reviewed were left out: `graspe dataset report` counts such rows, docs/labels.md tells what "
    "is judged."
)
"""Why the steps of a row are not judged, and where to look, for the texts of errors."""
SUCCESS, MASK = LABEL_COLUMNS = ("success", "success_mask")


@dataclass(frozen=True)
class Labels:
    """What is known of the rows of a split.

    Attributes:
        success: bool (N, T), whether the step succeeds.
        mask: bool (N, T), whether it is judged.
    """

    success: NDArray[np.bool_]
    mask: NDArray[np.bool_]

    @property
    def judged_rows(self) -> NDArray[np.int64]:
        """Rows with a judged step: the others teach nothing and are not read."""
        return np.flatnonzero(self.mask.any(axis=1)).astype(np.int64, copy=False)

    @property
    def failing(self) -> NDArray[np.bool_]:
        """Whether a judged step of the row fails, (N,)."""
        return rows_with_failure(self.success, self.mask)


def read_labels(folder: Path, split: str) -> Labels:
    """Read the labels of a split.

    Raises:
        ShardError: No such dataset, split or columns, or the labels are damaged.
        ZooError: The judged steps of the split are all of one class, there are none, or a label
            is neither 0 nor 1.
    """
    rows = Dataset(folder, split, LABEL_COLUMNS, check="sha256")
    arrays = rows.batch(np.arange(len(rows)))
    where, mask = f"{folder}: split {split!r}", arrays[MASK].astype(bool)
    check_binary(arrays[SUCCESS], mask, f"{where}: {SUCCESS}")
    labels = Labels(arrays[SUCCESS].astype(bool), mask)
    _check_classes(labels, where)
    return labels


def check_binary(success: NDArray[np.generic], judged: NDArray[np.bool_], where: str) -> None:
    """Refuse labels that are neither 0 nor 1.

    Args:
        success: (N, ...).
        judged: bool, of the same leading shape; others may hold anything.
        where: The column, for the error's text.

    Raises:
        ZooError: Names the first row and what it holds.
    """
    wrong = (success != 0) & (success != 1) & judged
    if wrong.any():
        row = int(np.argwhere(wrong)[0, 0])
        raise ZooError(
            f"{where}: row {row} holds {success[wrong][0]}, expected 0 for failure or 1 for "
            "success where a step is judged. Build the dataset again."
        )


def _check_classes(labels: Labels, where: str) -> None:
    judged = labels.success[labels.mask]
    if not judged.size:
        raise ZooError(
            f"{where}: none of {len(labels.mask)} rows has a judged step, expected both "
            f"successes and failures. {UNJUDGED}"
        )
    if judged.all() or not judged.any():
        only = "successes" if judged.all() else "failures"
        raise ZooError(
            f"{where}: its {judged.size} judged steps are all {only}, expected both classes. Add "
            f"recordings with the other, or move some from another split."
        )
