from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import torch
from numpy.typing import NDArray

from graspe_data.columns import Column
from graspe_data.shards.dataset_index import DatasetIndex, RecordingEntry, write_index
from graspe_data.shards.shard_writer import write_shard


@pytest.fixture(autouse=True, scope="session")
def one_thread() -> None:
    """Tests run beside each other: more threads than cores would only wait."""
    torch.set_num_threads(1)


@pytest.fixture
def build_dataset(tmp_path: Path) -> Callable[..., Path]:
    """Write a dataset of so many rows; row k has ``row`` k and a picture full of k."""

    def build(rows: int = 23, rows_per_shard: int = 5, name: str = "dataset") -> Path:
        common = {"unit": "", "frame": "", "meaning": "", "stage": "test"}
        columns = (
            Column(name="image", dtype="uint8", shape=(4, 6, 3), **common),
            Column(name="row", dtype="int64", shape=(), **common),
            Column(name="success", dtype="bool", shape=(2,), **common),
        )
        shards = []
        for begin in range(0, rows, rows_per_shard):
            row = np.arange(begin, min(begin + rows_per_shard, rows))
            image = np.broadcast_to(row[:, None, None, None], (row.size, 4, 6, 3))
            success = np.stack([row % 2 == 0, row % 3 == 0], axis=1)
            arrays: dict[str, NDArray[np.generic]] = {
                "image": image.astype(np.uint8),
                "row": row,
                "success": success,
            }
            shards.append(write_shard(tmp_path / name, f"train/{begin}.npz", columns, arrays))
        recording = RecordingEntry(
            name="a.bag", digest=f"{rows:064x}", group="", split="train", rows=rows
        )
        index = DatasetIndex(
            name="tiny",
            columns=columns,
            group_key="day",
            splits={"train": shards},
            recordings=[recording],
        )
        write_index(tmp_path / name, index)
        return tmp_path / name

    return build
