from __future__ import annotations

import hashlib
import os
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from graspe_data.columns import Column
from graspe_data.errors import ManifestError, ShardError
from graspe_data.shards.shard_writer import write_shard

Arrays = dict[str, NDArray[np.generic]]

COMMON = {"unit": "", "frame": "", "meaning": "", "stage": "test"}
COLUMNS = (
    Column(name="picture", dtype="uint8", shape=(2, 2, 3), codec="jpeg", **COMMON),
    Column(name="bits", dtype="bool", shape=(3, 9), codec="packed_bits", **COMMON),
    Column(name="speed", dtype="float32", shape=(), **COMMON),
)


def arrays() -> Arrays:
    return {
        "picture.bytes": np.arange(10, dtype=np.uint8),
        "picture.offsets": np.array([0, 4, 10]),
        "bits": np.zeros((2, 3, 2), np.uint8),
        "speed": np.ones(2, np.float32),
    }


def test_the_entry_describes_the_file(tmp_path: Path) -> None:
    entry = write_shard(tmp_path, "train/0.npz", COLUMNS, arrays())
    content = (tmp_path / "train" / "0.npz").read_bytes()
    assert (entry.path, entry.rows, entry.bytes) == ("train/0.npz", 2, len(content))
    assert entry.columns.keys() == arrays().keys()


def test_the_same_rows_give_the_bytes_they_always_gave(tmp_path: Path) -> None:
    write_shard(tmp_path, "0.npz", COLUMNS, arrays())
    digest = hashlib.sha256((tmp_path / "0.npz").read_bytes()).hexdigest()
    assert digest == "4cd7a2b05019dcc0498e3c808c001d9bca849fc34c2289f6c5caee2d9d1bb4a0"


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"speed": np.ones(2)}, r"0\.npz: speed: expected float32 \(2,\), found float64 \(2,\)"),
        ({"speed": np.ones(3, np.float32)}, r"speed: expected float32 \(2,\), found float32 \(3,"),
        ({"bits": np.zeros((2, 3, 9), bool)}, r"bits: expected uint8 \(2, 3, 2\), found bool"),
        ({"picture.offsets": np.array([0, 11, 10])}, "expected to rise from 0 to 10"),
        ({"picture.offsets": np.array([1, 4, 10])}, "expected to rise from 0 to 10"),
        ({"picture.offsets": np.array([0, 4, 9])}, "expected to rise from 0 to 10"),
        ({"extra": np.zeros(2)}, "declared columns differ in: extra"),
    ],
)
def test_arrays_that_are_not_as_declared_are_refused(
    tmp_path: Path, change: Arrays, message: str
) -> None:
    with pytest.raises(ShardError, match=message):
        write_shard(tmp_path, "0.npz", COLUMNS, arrays() | change)
    assert list(tmp_path.iterdir()) == []


def test_a_path_out_of_the_folder_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ManifestError, match="relative path within"):
        write_shard(tmp_path, "../0.npz", COLUMNS, arrays())


def test_a_failure_before_the_end_leaves_the_file_of_before(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write_shard(tmp_path, "0.npz", COLUMNS, arrays())
    before = (tmp_path / "0.npz").read_bytes()

    def full_disk(_: int) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full_disk)
    with pytest.raises(ShardError, match="No space left on device"):
        write_shard(tmp_path, "0.npz", COLUMNS, arrays() | {"speed": np.zeros(2, np.float32)})
    assert [file.name for file in tmp_path.iterdir()] == ["0.npz"]
    assert (tmp_path / "0.npz").read_bytes() == before
