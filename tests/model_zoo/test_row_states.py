"""The state of a row is read where it is stored, else derived."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from graspe_data.errors import ZooError
from graspe_data.shards import Dataset
from graspe_data.shards.dataset_index import read_index, write_index
from model_zoo.row_states import STEP_S, read_row_states, step_seconds
from tests.model_zoo.checkpoints.tiny_model import COLUMNS, write_tiny_dataset

SECOND = 1_000_000_000


def states(dataset: Path) -> list[int]:
    rows = Dataset(dataset, "test", ("success", "success_mask"))
    found = rows.batch(np.arange(len(rows)))
    labels = found["success"].astype(bool), found["success_mask"].astype(bool)
    return [int(state) for state in read_row_states(dataset, "test", *labels)]


def test_a_stored_state_is_taken(tmp_path: Path) -> None:
    assert states(write_tiny_dataset(tmp_path, ("hill",), state=2)) == [2] * 12


def test_what_is_no_state_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ZooError, match=r"column state holds 7, expected 0 to 3"):
        states(write_tiny_dataset(tmp_path, ("hill",), state=7))


@pytest.mark.parametrize(
    ("velocity", "success", "expected"), [(0.0, 1, 1), (-1.0, 1, 2), (1.0, 1, 3), (1.0, 0, 0)]
)
def test_an_older_dataset_tells_by_labels_and_velocities(
    tmp_path: Path, velocity: float, success: int, expected: int
) -> None:
    older = tuple(column for column in COLUMNS if column.name != "state")
    changed: dict[str, Any] = {"velocity_history": velocity, "success": success, "success_mask": 1}
    dataset = write_tiny_dataset(tmp_path, ("hill",), columns=older, **changed)
    assert states(dataset) == [expected] * 12


def test_without_velocities_what_does_not_fail_drives(tmp_path: Path) -> None:
    bare = tuple(c for c in COLUMNS if c.name not in ("state", "velocity_history", "stamp_ns"))
    assert set(states(write_tiny_dataset(tmp_path, ("hill",), columns=bare, success=1))) == {3}


def test_the_length_of_a_step_is_the_dataset_s(tmp_path: Path) -> None:
    index = read_index(write_tiny_dataset(tmp_path, ("hill",)))
    assert step_seconds(index) == STEP_S
    change = {"configuration": {"dataset": {"horizon": {"step_s": 0.5}}}}
    assert step_seconds(write_index(tmp_path, index.model_copy(update=change))) == 0.5
