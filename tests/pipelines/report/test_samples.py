"""The rows that a report shows."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from graspe_data.shards.dataset_index import (
    DatasetIndex,
    RecordingEntry,
    write_index,
)
from graspe_data.shards.shard_writer import write_shard
from pipelines.report import samples
from pipelines.row_columns import row_columns
from tests.pipelines.report.conftest import recipe, stored_rows


def test_samples_show_failures_and_the_least_reliable_and_no_row_twice(dataset: Path) -> None:
    groups = samples.choose_samples(dataset, ("train", "validation"))
    failing, succeeding, picture, _ = (group.rows for group in groups)
    assert [(c.split, c.row) for c in failing] == [("train", 0), ("train", 1), ("train", 2)]
    assert [c.split for c in succeeding] == ["train", "train", "validation", "validation"]
    assert picture[0].rank < picture[1].rank
    shown = [(c.split, c.row) for group in groups for c in group.rows]
    assert len(shown) == len(set(shown))


def test_failures_are_shown_of_every_recording_and_from_before_they_begin(tmp_path: Path) -> None:
    rows = stored_rows(40, 0, failing=0)
    rows["recording"][20:] = 1
    rows["success_mask"][:] = True
    begins = np.tile(np.repeat([9, 5, 2, 0], 5), 2)
    rows["success"] = (np.arange(10) < begins[:, None]).astype(rows["success"].dtype)
    columns = row_columns(recipe())
    shard = write_shard(tmp_path, "shards/train.npz", columns, rows)
    entries = [
        RecordingEntry(name=name, digest=name * 64, group=name, split="train", rows=20)
        for name in "ab"
    ]
    written = DatasetIndex(
        name="tiny",
        columns=tuple(columns),
        group_key="day",
        splits={"train": [shard]},
        recordings=entries,
    )
    write_index(tmp_path, written)
    failing = samples.choose_samples(tmp_path, ("train",))[0].rows
    assert [c.recording for c in failing] == [0, 0, 1, 1]
    assert all(begins[c.row] > 0 for c in failing)
    for one, other in (failing[:2], failing[2:]):
        assert 5 in begins[[one.row, other.row]]
        assert other.stamp_ns - one.stamp_ns >= 3 * 10**8
