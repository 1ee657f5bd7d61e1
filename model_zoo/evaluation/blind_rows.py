"""The rows that blind references are taught on, chosen by and asked about."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from graspe_data.arrays import Floats, Indices, Mask
from graspe_data.errors import ZooError
from graspe_data.shards import Dataset
from graspe_data.shards.dataset_index import DatasetIndex, read_index
from model_zoo.evaluation.blind_features import LASER_SCAN, VELOCITY_HISTORY, blind_features
from model_zoo.evaluation.blind_teaching import LabelledRows
from model_zoo.evaluation.scenes import Candidates, read_candidates
from model_zoo.validation_rows import VALIDATION, read_validation_rows

TAUGHT, CHOSE = "train", VALIDATION
MOST_ROWS = 4000
"""To teach on or to choose by, evenly over the split: neighbours are much alike."""


@dataclass(frozen=True)
class BlindRows:
    """Rows as references see them.

    Attributes:
        columns: ``velocity_history``, and ``laser_scan`` where the dataset has it.
        success: bool (N, T).
        mask: bool (N, T), whether the step is judged.
        candidates: Where the dataset has them.
    """

    columns: dict[str, NDArray[Any]]
    success: Mask
    mask: Mask
    candidates: Candidates | None

    @property
    def velocity(self) -> Floats:
        """Of the driven trajectory: that at the anchor, (N, 2)."""
        return self.columns[VELOCITY_HISTORY][:, -1].astype(np.float64)

    def driven(self, reference: str) -> LabelledRows:
        """The driven trajectories, step by step."""
        features = blind_features(reference, self.velocity, self.columns)
        return LabelledRows(features, self.success, self.mask)

    def other(self, reference: str) -> LabelledRows:
        """The candidates, N K rows of one step: whether each gets through to its end."""
        if self.candidates is None:
            raise ValueError("rows without candidates")
        number = self.candidates.mask.shape[1]
        columns = {name: np.repeat(c, number, axis=0) for name, c in self.columns.items()}
        velocity = self.candidates.velocity.reshape(-1, 2)
        features = blind_features(reference, velocity, columns)
        flat = (self.candidates.through.reshape(-1, 1), self.candidates.mask.reshape(-1, 1))
        return LabelledRows(features, *flat, of_a_scene=number)


def read_blind_rows(folder: Path, split: str, rows: Indices) -> BlindRows:
    """Read some rows of a split.

    Raises:
        ZooError: The dataset has no velocity history.
        ShardError: No such dataset or split, or a column is damaged.
    """
    index = read_index(folder)
    names = blind_columns(index, folder)
    batch = Dataset(folder, split, (*names, *_LABELS), check="sha256").batch(rows)
    return BlindRows(
        {name: batch[name] for name in names},
        batch["success"].astype(bool),
        batch["success_mask"].astype(bool),
        read_candidates(index, folder, split, rows),
    )


_LABELS = ("success", "success_mask")


def blind_columns(index: DatasetIndex, where: Path) -> tuple[str, ...]:
    """The columns that references read: the velocity history, and the scan where there is one.

    Raises:
        ZooError: The dataset has no velocity history.
    """
    declared = {column.name for column in index.columns}
    if VELOCITY_HISTORY not in declared:
        raise ZooError(
            f"{where}: no column {VELOCITY_HISTORY}, which the blind references read, and no "
            f"score is shown without them. Build the dataset with `graspe dataset build`."
        )
    return tuple(name for name in (VELOCITY_HISTORY, LASER_SCAN) if name in declared)


def rows_to_teach(folder: Path) -> BlindRows:
    """Judged training rows, evenly over the split.

    Raises:
        ZooError: The dataset has no training rows.
    """
    index = read_index(folder)
    if TAUGHT not in index.splits or not index.rows(TAUGHT):
        found = ", ".join(sorted(index.splits)) or "none"
        raise ZooError(
            f"{folder}: no rows in the split {TAUGHT!r} to teach the blind references on, and no "
            f"score is shown without them; splits found: {found}. Name the dataset that the model "
            f"was trained on with --references."
        )
    judged = np.flatnonzero(_labels(folder, TAUGHT)[1].any(axis=1))
    return read_blind_rows(folder, TAUGHT, _evenly(judged))


def rows_to_choose(folder: Path) -> BlindRows | None:
    """The judged validation rows that select; None where there are none."""
    index = read_index(folder)
    if CHOSE not in index.splits or not index.rows(CHOSE):
        return None
    success, mask = _labels(folder, CHOSE)
    selecting = read_validation_rows(folder, success, mask).selecting
    rows = np.flatnonzero(mask.any(axis=1) & selecting)
    return read_blind_rows(folder, CHOSE, _evenly(rows))


def _labels(folder: Path, split: str) -> tuple[Mask, Mask]:
    rows = Dataset(folder, split, _LABELS, check="sha256")
    batch = rows.batch(np.arange(len(rows)))
    return batch["success"].astype(bool), batch["success_mask"].astype(bool)


def _evenly(rows: NDArray[np.intp]) -> Indices:
    """At most so many of the rows, evenly spread."""
    chosen = np.linspace(0, rows.size - 1, min(rows.size, MOST_ROWS)).round().astype(np.int64)
    return rows[chosen].astype(np.int64)
