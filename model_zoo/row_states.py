"""The state at the anchor of each row of a split, stored or derived."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from graspe_data.arrays import Mask
from graspe_data.errors import ZooError
from graspe_data.observation.labels import AnchorState, anchor_states, failing_by_labels
from graspe_data.shards import Dataset
from graspe_data.shards.dataset_index import DatasetIndex

STATE, HISTORY = "state", "velocity_history"
STEP_S = 0.3
"""Where a dataset does not tell how long a step is."""


def step_seconds(index: DatasetIndex) -> float:
    """Length of a step of the horizon, seconds."""
    found: object = index.configuration
    for key in ("dataset", "horizon", "step_s"):
        found = found.get(key) if isinstance(found, Mapping) else None
    return float(found) if isinstance(found, int | float) and found > 0 else STEP_S


def read_row_states(folder: Path, split: str, success: Mask, mask: Mask) -> NDArray[np.uint8]:
    """The :class:`AnchorState` of every row of a split, uint8 (N,).

    Read from the column ``state``; in a dataset without it derived from the labels and the last
    velocity of the history, see :func:`failing_by_labels`. What neither tells is driving.

    Args:
        folder: The dataset's.
        split: Of it.
        success: bool (N, T), of the split's rows in their order.
        mask: bool (N, T), whether the step is judged.

    Raises:
        ShardError: No such dataset or split, or a column is damaged.
        ZooError: The column holds what is no state.
    """
    index = Dataset(folder, split, ()).index
    declared = {column.name for column in index.columns}
    if STATE in declared:
        return _stored_states(folder, split)
    names = tuple(name for name in ("stamp_ns", "recording", HISTORY) if name in declared)
    found = Dataset(folder, split, names, check="sha256").batch(np.arange(len(mask)))
    failing = failing_by_labels(
        _or_zeros(found, "stamp_ns", len(mask)),
        _or_zeros(found, "recording", len(mask)),
        success,
        mask,
        round(step_seconds(index) * 1e9),
    )
    moving = np.ones((len(mask), 2))
    velocity = found[HISTORY][:, -1].astype(np.float64) if HISTORY in found else moving
    return anchor_states(failing, velocity)


def _stored_states(folder: Path, split: str) -> NDArray[np.uint8]:
    rows = Dataset(folder, split, (STATE,), check="sha256")
    states = rows.batch(np.arange(len(rows)))[STATE].astype(np.uint8)
    strange = states > max(AnchorState)
    if strange.any():
        raise ZooError(
            f"{folder}: split {split!r}: column {STATE} holds {states[strange][0]}, expected 0 to "
            f"{max(AnchorState)}. Build the dataset again."
        )
    return states


def _or_zeros(columns: dict[str, NDArray[Any]], name: str, rows: int) -> NDArray[np.int64]:
    return columns[name].astype(np.int64) if name in columns else np.zeros(rows, np.int64)
