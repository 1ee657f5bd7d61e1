"""The rows of a split on which a checkpoint can be scored."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from graspe_data.arrays import Indices, Mask
from graspe_data.errors import ZooError
from graspe_data.shards import Dataset
from graspe_data.shards.dataset_index import DatasetIndex, RecordingEntry, read_index
from model_zoo.augmentation import (
    FAILING_SENSOR,
    Condition,
    check_lidar_may_fail,
    chosen_conditions,
    columns_needed,
)
from model_zoo.checkpoints import Checkpoint
from model_zoo.checkpoints.assumptions import read_assumptions
from model_zoo.checkpoints.lineage import check_observed_alike
from model_zoo.contents import check_values
from model_zoo.contract import CANDIDATE_IMAGE, DRIVEN
from model_zoo.evaluation.cell import ALL_SCENARIOS
from model_zoo.evaluation.parts import part_mask
from model_zoo.evaluation.scenes import Candidates, read_candidates
from model_zoo.labels import UNJUDGED, check_binary
from model_zoo.row_states import read_row_states, step_seconds

_LABELS = ("success", "success_mask", "recording")
_UNGROUPED = "ungrouped"


@dataclass(frozen=True)
class JudgedSplit:
    """Rows that have a judged step; the others change no score.

    Attributes:
        name: The split's.
        dataset: The split, with the columns that the model and the conditions read; what they
            hold is checked when a shard is first touched.
        rows: Indices of the rows, (N,).
        success: (N, T), 1 = success.
        mask: (N, T), true where judged.
        recording: (N,), index of each row's recording.
        scenarios: The scenario of each recording of the dataset.
        state: uint8 (N,), at the anchor; see :class:`AnchorState`.
        step_s: Length of a step, seconds.
        candidates: The other trajectories of the rows, where a simulated dataset has them.
    """

    name: str
    dataset: Dataset
    rows: Indices
    success: Mask
    mask: Mask
    recording: Indices
    scenarios: tuple[str, ...]
    state: NDArray[np.uint8]
    step_s: float
    candidates: Candidates | None

    def part(self, part: str) -> Mask:
        """The judged steps of a part, bool (N, T)."""
        return part_mask(part, self.success, self.mask, self.state, self.step_s)


def open_judged_split(
    checkpoint: Checkpoint,
    path: Path,
    split: str,
    conditions: Sequence[Condition],
    every: int = 1,
) -> JudgedSplit:
    """Check that a dataset fits a checkpoint, and read its labels.

    Raises:
        ZooError: The dataset does not fit the model or a condition, the split has no judged step, a
            label is neither 0 nor 1, a row is of no recording, a condition is unknown, or ``every``
            is not positive.
        ShardError: The dataset is missing or damaged, or has no such split.
    """
    chosen_conditions(conditions)
    if every < 1:
        raise ZooError(f"every: found {every}; give 1 for all rows, 2 for every second, and so on.")
    index = read_index(path)
    _check_columns(checkpoint, index, path)
    _check_lineage(checkpoint, index, split, path)
    _check_rows(index, split, path)
    labels = Dataset(path, split, _LABELS, check="sha256")
    columns = labels.batch(np.arange(len(labels)))
    _check_recordings(columns["recording"], index, split, path)
    rows = _judged_rows(columns, f"{path}: split {split!r}")
    success, mask = columns["success"].astype(bool), columns["success_mask"].astype(bool)
    state = read_row_states(path, split, success, mask)
    if every > 1:
        stamps = Dataset(path, split, ("stamp_ns",), check="sha256").batch(rows)["stamp_ns"]
        rows = _thinned(rows, columns["recording"][rows], stamps, every)
    names = _columns(checkpoint, index, conditions, path)
    check_values(Dataset(path, split, checkpoint.model.columns))
    return JudgedSplit(
        name=split,
        dataset=Dataset(path, split, names, check="sha256"),
        rows=rows,
        success=success[rows],
        mask=mask[rows],
        recording=columns["recording"].astype(np.int64)[rows],
        scenarios=tuple(_scenario(entry) for entry in index.recordings),
        state=state[rows],
        step_s=step_seconds(index),
        candidates=read_candidates(index, path, split, rows),
    )


def _judged_rows(columns: Mapping[str, NDArray[Any]], where: str) -> Indices:
    """The rows that have a judged step, in order."""
    mask = columns["success_mask"].astype(bool)
    check_binary(columns["success"], mask, f"{where}: success")
    rows = np.flatnonzero(mask.any(axis=1)).astype(np.int64, copy=False)
    if not rows.size:
        raise ZooError(
            f"{where}: none of its {len(mask)} rows has a judged step, so there is nothing to "
            f"score. {UNJUDGED}"
        )
    return rows


def _check_rows(index: DatasetIndex, split: str, path: Path) -> None:
    if not index.rows(split):
        found = ", ".join(f"{name} {index.rows(name)}" for name in index.splits)
        raise ZooError(
            f"{path}: the split {split!r} has no rows, so there is nothing to score; rows found: "
            f"{found}. Give another --split; or declare a group of recordings for it under "
            f"split.groups in the dataset's manifest, and build again."
        )


def _thinned(rows: Indices, recording: NDArray[Any], stamp_ns: NDArray[Any], every: int) -> Indices:
    """Every so many of each recording's rows, in the order of their stamps; rows stay sorted."""
    # By recording, then by stamp.
    order = np.lexsort((stamp_ns, recording))
    # How far each row lies behind the first of its recording.
    starts = np.flatnonzero(np.diff(recording[order], prepend=-1))
    since = np.arange(len(rows)) - np.repeat(starts, np.diff(starts, append=len(rows)))
    return np.sort(rows[order[since % min(every, len(rows)) == 0]])


def _check_lineage(checkpoint: Checkpoint, index: DatasetIndex, split: str, path: Path) -> None:
    """The rows are new to the model, and were made as those that taught it."""
    config, found = checkpoint.config, read_assumptions(index)
    if config.lineage is not None:
        own = index.dataset_digest == config.dataset_digest
        config.lineage.check_unseen(index, split, str(path), own=own)
    if config.assumptions is not None and found is not None:
        trained, evaluated = (each.observation.model_dump() for each in (config.assumptions, found))
        check_observed_alike(trained, evaluated, str(path))


def _check_recordings(recording: NDArray[Any], index: DatasetIndex, split: str, path: Path) -> None:
    count = len(index.recordings)
    own = np.array([entry.split == split for entry in index.recordings], np.bool_)
    inside = (recording >= 0) & (recording < count)
    strange = recording[~inside] if not inside.all() else recording[~own[recording]]
    if strange.size:
        raise ZooError(
            f"{path}: {split!r}: column recording: found {strange[0]}, expected 0 to {count - 1}, "
            f"the place of a recording of this split in the list of recordings. Build the dataset "
            f"again."
        )


def _check_columns(checkpoint: Checkpoint, index: DatasetIndex, path: Path) -> None:
    checkpoint.config.check_columns(index.columns, str(path))
    shapes = {column.name: column.shape for column in index.columns}
    horizon = checkpoint.config.horizon
    for name, expected in zip(_LABELS, ((horizon,), (horizon,), ()), strict=True):
        if shapes.get(name) != expected:
            raise ZooError(
                f"{path}: column {name}: expected rows of shape {expected} for "
                f"{checkpoint.config.model}, found {shapes.get(name, 'no such column')}."
            )
    if any(entry.group == ALL_SCENARIOS for entry in index.recordings):
        raise ZooError(
            f"{path}: a group is named {ALL_SCENARIOS!r}, which stands for all groups together. "
            "Rename it and build the dataset again."
        )


def _columns(
    checkpoint: Checkpoint, index: DatasetIndex, conditions: Sequence[Condition], path: Path
) -> list[str]:
    """The model's, and where sensors fail what that reads; stamps name the rows."""
    declared = {column.name for column in index.columns}
    names = checkpoint.model.columns
    drawn = DRIVEN in checkpoint.model.candidate_columns and CANDIDATE_IMAGE in declared
    asked = (CANDIDATE_IMAGE,) if drawn else ()
    if set(conditions) == {"clean"}:
        return [*names, *asked]
    of_lidar = [name for name in conditions if FAILING_SENSOR.get(name) == "lidar"]
    if of_lidar:
        otherwise = f"leave {', '.join(of_lidar)} out (--clean)"
        check_lidar_may_fail(names, declared, str(path), otherwise)
    return sorted({*columns_needed(names, declared), *asked, *({"stamp_ns"} & declared)})


def _scenario(entry: RecordingEntry) -> str:
    """The group of a recording; one in no declared group has its own, named by its digest."""
    own = not entry.group or entry.digest.startswith(entry.group)
    return _UNGROUPED if own else entry.group
