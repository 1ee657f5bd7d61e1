from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from graspe_data.columns import Codec, Column
from graspe_data.shards.dataset_index import DatasetIndex, RecordingEntry, write_index
from graspe_data.shards.shard_writer import write_shard

ROWS = 23

Arrays = dict[str, NDArray[np.generic]]


def column(name: str, dtype: str, shape: tuple[int, ...], codec: Codec = "raw") -> Column:
    return Column(
        name=name,
        dtype=dtype,
        shape=shape,
        unit="",
        frame="",
        meaning="",
        stage="test",
        codec=codec,
    )


@pytest.fixture(scope="session")
def columns() -> tuple[Column, ...]:
    return (
        column("image", "uint8", (24, 32, 3), "png"),
        column("points", "float32", (300, 3)),
        column("velocity", "float32", (5, 2)),
        column("success", "bool", (4,)),
        column("drawing", "uint8", (6, 21), "packed_bits"),
        column("row", "int64", ()),
    )


@pytest.fixture(scope="session")
def rows() -> Arrays:
    """The rows as they should come back, decoded."""
    draw = np.random.default_rng(7)
    return {
        "image": draw.integers(0, 256, (ROWS, 24, 32, 3), dtype=np.uint8),
        "points": draw.random((ROWS, 300, 3), dtype=np.float32),
        "velocity": draw.random((ROWS, 5, 2), dtype=np.float32),
        "success": draw.random((ROWS, 4)) > 0.5,
        "drawing": (draw.random((ROWS, 6, 21)) > 0.5).astype(np.uint8),
        "row": np.arange(ROWS),
    }


def stored(rows: Arrays) -> Arrays:
    pictures = [cv2.imencode(".png", image[..., ::-1])[1] for image in np.asarray(rows["image"])]
    plain = {name: array for name, array in rows.items() if name not in ("image", "drawing")}
    return plain | {
        "image.bytes": np.concatenate([np.empty(0, np.uint8), *pictures]),
        "image.offsets": np.cumsum([0, *(picture.size for picture in pictures)], dtype=np.int64),
        "drawing": np.packbits(rows["drawing"].astype(np.uint8), axis=-1),
    }


@pytest.fixture
def build(tmp_path: Path, columns: tuple[Column, ...], rows: Arrays) -> Callable[[int, str], Path]:
    """Write the rows as a dataset with so many rows a shard, into a folder of that name."""

    def build_dataset(rows_per_shard: int, name: str = "dataset") -> Path:
        folder = tmp_path / name
        shards = []
        for begin in range(0, ROWS, rows_per_shard):
            part = {key: array[begin : begin + rows_per_shard] for key, array in rows.items()}
            shards.append(write_shard(folder, f"train/{begin:05d}.npz", columns, stored(part)))
        recording = RecordingEntry(
            name="drive.bag", digest="ab" * 32, group="monday", split="train", rows=ROWS
        )
        index = DatasetIndex(
            name="tiny",
            columns=columns,
            group_key="day",
            splits={"train": shards, "test": []},
            recordings=[recording],
            storage={"rows_per_shard": rows_per_shard},
        )
        write_index(folder, index)
        return folder

    return build_dataset


@pytest.fixture
def dataset_path(build: Callable[[int, str], Path]) -> Path:
    return build(8, "dataset")
