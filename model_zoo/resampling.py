"""The rows that PAAD trains on: fewer successes, each failure twice, once mirrored."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from graspe_data.errors import ZooError


@dataclass(frozen=True)
class TrainingRows:
    """Rows to train on in one epoch, before they are shuffled.

    Attributes:
        indices: int64 (M,), rows of the split; a row that fails occurs twice.
        mirrored: bool (M,), whether the row is mirrored, all its modalities, before it is used.
    """

    indices: NDArray[np.int64]
    mirrored: NDArray[np.bool_]

    def __len__(self) -> int:
        """Rows of an epoch, M."""
        return len(self.indices)


def rows_with_failure(success: NDArray[np.generic], mask: NDArray[np.generic]) -> NDArray[np.bool_]:
    """Find the rows in which any judged step fails: the meaning of a negative sample.

    Args:
        success: (N, T), 1 = success.
        mask: (N, T), whether the step is judged.

    Returns:
        bool (N,).
    """
    failing: NDArray[np.bool_] = (success == 0) & (mask != 0)
    return np.asarray(np.any(failing, axis=1))


def rows_for_training(any_failure: NDArray[np.bool_]) -> TrainingRows:
    """Choose the rows of an epoch as PAAD's dataset does.

    With r = round(successes / (2 failures)) - 1, at least 1, every r-th row without a failure is
    kept, and every row with one is kept together with its mirror image (tianchenji/PAAD,
    custom_dataset.py; its r of 0 in balanced data, which divides by zero, becomes 1).

    Args:
        any_failure: bool (N,), from :func:`rows_with_failure`.

    Returns:
        The rows kept, in their order, then the mirrored ones.

    Raises:
        ZooError: No row fails, so that there is nothing to balance.
    """
    failures = np.flatnonzero(any_failure)
    successes = np.flatnonzero(~any_failure)
    if not len(failures):
        raise ZooError(
            f"training rows: none of {len(any_failure)} has a step that fails, expected some; "
            "train on a split with failures, or look at its labels with `graspe label propose`."
        )
    stride = max(1, round(len(successes) / (2 * len(failures))) - 1)
    kept = np.sort(np.concatenate((successes[::stride], failures)))
    mirrored = np.arange(len(kept) + len(failures)) >= len(kept)
    return TrainingRows(np.concatenate((kept, failures)).astype(np.int64), mirrored)
