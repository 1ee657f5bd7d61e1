"""What is trained on is what the checkpoint names: every column that is read was verified once."""

from __future__ import annotations

from pathlib import Path

import pytest

from graspe_data.errors import ShardError
from graspe_data.shards.aligned_npz import NpzMap
from model_zoo.registry import MODELS, create_model
from tests.model_zoo.training.smallest import SMALLEST, train_smallest, write_rows
from tests.model_zoo.training.tiny import make_splits, train_tiny, write_dataset

SPLITS = ("train", "validation")


def flip(shard: Path, column: str) -> None:
    """One bit of a column's last value."""
    mapped = NpzMap(shard)
    extent = mapped._extent(column)
    content = bytearray(shard.read_bytes())
    content[extent.offset + extent.size - 1] ^= 1
    shard.write_bytes(content)


@pytest.mark.parametrize("name", MODELS)
def test_a_flipped_bit_in_any_column_that_a_model_reads_is_found(name: str, tmp_path: Path) -> None:
    dataset = write_rows(tmp_path / "dataset")
    read = (*create_model(name, "small", **SMALLEST[name]).columns, "success", "success_mask")
    for column in read:
        for split in SPLITS:
            shard = dataset / split / "0.npz"
            sound = shard.read_bytes()
            flip(shard, column)
            with pytest.raises(ShardError, match=rf"{split}/0\.npz: {column}: its sha256 does not"):
                train_smallest(name, dataset, tmp_path / "out")
            shard.write_bytes(sound)
    assert not (tmp_path / "out" / "checkpoint").exists()


@pytest.mark.parametrize("split", SPLITS)
def test_two_shards_of_equal_size_in_each_others_place(split: str, tmp_path: Path) -> None:
    splits = {name: {k: v[:8] for k, v in rows.items()} for name, rows in make_splits().items()}
    dataset = write_dataset(tmp_path / "dataset", splits, pieces=2)
    first, second = (dataset / split / f"{k}.npz" for k in (0, 1))
    assert first.stat().st_size == second.stat().st_size
    first.rename(tmp_path / "kept")
    second.rename(first)
    (tmp_path / "kept").rename(second)
    with pytest.raises(ShardError, match=rf"0\.npz: .* It is that of {split}/1\.npz"):
        train_tiny(dataset, tmp_path / "out")


def test_a_column_that_is_not_read_may_be_damaged(tmp_path: Path) -> None:
    dataset = write_dataset(tmp_path / "dataset", make_splits())
    flip(dataset / "train" / "0.npz", "laser_scan")
    train_tiny(dataset, tmp_path / "out")
    assert (tmp_path / "out" / "checkpoint").exists()
