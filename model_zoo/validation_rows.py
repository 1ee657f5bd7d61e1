"""The validation rows of a dataset: which half each is in, and by which steps to select."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from graspe_data.arrays import Mask
from graspe_data.observation.labels import AnchorState
from graspe_data.shards import Dataset
from model_zoo.row_states import read_row_states, step_seconds
from model_zoo.validation_halves import Halves, halve_validation

VALIDATION = "validation"


@dataclass(frozen=True)
class ValidationRows:
    """What validation rows are for.

    Attributes:
        halves: Which rows select and which calibrate.
        selecting: bool (N,), the rows whose scores select: of that half those in which no failure
            is under way at the anchor, as the primary figure has it; all of the half where those
            are of one class.
    """

    halves: Halves
    selecting: Mask


def read_validation_rows(folder: Path, success: Mask, mask: Mask) -> ValidationRows:
    """Divide the validation rows of a dataset.

    Args:
        folder: The dataset's.
        success: bool (N, T), of all validation rows in their order.
        mask: bool (N, T), whether the step is judged.

    Raises:
        ShardError: No such dataset or split, or a column is damaged.
        ZooError: A column holds what it cannot.
    """
    index = Dataset(folder, VALIDATION, ()).index
    declared = {column.name for column in index.columns}
    names = tuple(name for name in ("recording", "stamp_ns") if name in declared)
    found = Dataset(folder, VALIDATION, names, check="sha256").batch(np.arange(len(mask)))
    nothing = np.zeros(len(mask), np.int64)
    halves = halve_validation(
        index.recordings,
        VALIDATION,
        found.get("recording", nothing).astype(np.int64),
        found.get("stamp_ns", nothing).astype(np.int64),
        success,
        mask,
        horizon_ns=round(step_seconds(index) * mask.shape[1] * 1e9),
    )
    states = read_row_states(folder, VALIDATION, success, mask)
    sound = halves.selects & (states != AnchorState.FAILING)
    judged = success[sound][mask[sound]]
    both = judged.any() and not judged.all()
    return ValidationRows(halves, sound if both else halves.selects)
