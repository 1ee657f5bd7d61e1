"""Class balance: how many rows and steps succeed, fail, or are not judged."""

from __future__ import annotations

from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from graspe_data.observation.labels import LabelSource
from graspe_data.observation.labels.anchor_state import AnchorState
from graspe_data.shards.dataset_index import DatasetIndex
from pipelines.report.row_blocks import row_blocks

VALIDITY = ("image_valid", "points_valid", "odometry_valid")


@dataclass(frozen=True)
class Balance:
    """Counts of rows, and of their steps."""

    rows: int
    rows_failing: int
    rows_unjudged: int
    steps: int
    steps_failing: int
    steps_succeeding: int

    @property
    def steps_unjudged(self) -> int:
        """Steps that the recording cannot judge."""
        return self.steps - self.steps_failing - self.steps_succeeding


@dataclass(frozen=True)
class SplitBalance:
    """The balance of a split, and of the part of it that each recording (by index) gave.

    ``sources`` counts steps by who labelled them, ``valid`` rows by sensor, ``states`` rows by the
    state at their anchor; none of a dataset without the column ``state``.
    """

    whole: Balance
    recordings: dict[int, Balance]
    sources: dict[LabelSource, int]
    valid: dict[str, int]
    states: dict[AnchorState, int]


def split_balance(folder: Path, index: DatasetIndex, split: str) -> SplitBalance:
    """Count over one split.

    Raises:
        ShardError: A shard is missing or damaged.
    """
    counts = np.zeros((len(index.recordings), len(fields(Balance))), np.int64)
    sources = np.zeros(len(LabelSource), np.int64)
    valid, states = dict.fromkeys(VALIDITY, 0), np.zeros(len(AnchorState), np.int64)
    stated = [column.name for column in index.columns if column.name == "state"]
    columns = ("success", "success_mask", "label_source", "recording", *VALIDITY, *stated)
    for block in row_blocks(folder, split, columns):
        row = block.columns
        np.add.at(counts, row["recording"], _row_counts(row["success"], row["success_mask"]))
        sources += np.bincount(row["label_source"].ravel(), minlength=len(sources))
        if stated:
            states += np.bincount(row["state"].ravel(), minlength=len(states))
        for sensor in VALIDITY:
            valid[sensor] += int(np.count_nonzero(row[sensor]))
    return SplitBalance(
        whole=Balance(*counts.sum(axis=0).tolist()),
        recordings={i: Balance(*counts[i].tolist()) for i in np.flatnonzero(counts[:, 0]).tolist()},
        sources={source: int(sources[source]) for source in LabelSource},
        valid=valid,
        states={state: int(states[state]) for state in AnchorState} if stated else {},
    )


def _row_counts(success: NDArray[Any], judged: NDArray[np.bool_]) -> NDArray[np.int64]:
    """The fields of ``Balance`` for each row, (R, 6)."""
    good, bad = judged & (success == 1), judged & (success == 0)
    rows, steps = judged.shape
    columns = (
        np.ones(rows),
        bad.any(axis=1),
        ~judged.any(axis=1),
        np.full(rows, steps),
        bad.sum(axis=1),
        good.sum(axis=1),
    )
    return np.stack(columns, axis=1).astype(np.int64)
