from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from graspe_data.errors import ShardError
from graspe_data.shards.aligned_npz import NpzMap, map_npz, write_npz
from graspe_data.shards.verify import verify_dataset


def test_a_sound_dataset_has_no_faults(dataset_path: Path) -> None:
    assert verify_dataset(dataset_path) == []


def test_a_moved_dataset_has_no_faults(dataset_path: Path, tmp_path: Path) -> None:
    shutil.move(dataset_path, tmp_path / "elsewhere")
    assert verify_dataset(tmp_path / "elsewhere") == []


def test_a_flipped_bit_is_named_by_shard_column_and_digests(dataset_path: Path) -> None:
    shard = dataset_path / "train" / "00008.npz"
    expected = NpzMap(shard).digest("velocity")
    content = bytearray(shard.read_bytes())
    content[content.find(map_npz(shard)["velocity"].tobytes()) + 77] ^= 16
    shard.write_bytes(content)
    (fault,) = verify_dataset(dataset_path)
    assert (fault.split, fault.shard, fault.column) == ("train", "train/00008.npz", "velocity")
    assert fault.expected == f"SHA-256 {expected}"
    assert fault.found == f"SHA-256 {NpzMap(shard).digest('velocity')}"
    assert str(fault).startswith("train/00008.npz: velocity: expected SHA-256")


def test_every_flipped_bit_is_found(build: Callable[[int, str], Path]) -> None:
    """Headers, names, padding, data, directory: a sample of all bits of a shard."""
    folder = build(100, "one")
    shard = folder / "train" / "00000.npz"
    sound = shard.read_bytes()
    draw = np.random.default_rng(1)
    edges = [*range(128), *range(len(sound) - 600, len(sound))]
    for position in {*draw.integers(0, len(sound), 300).tolist(), *edges}:
        content = bytearray(sound)
        content[position] ^= 1 << int(draw.integers(8))
        shard.write_bytes(content)
        faults = verify_dataset(folder)
        assert faults, f"byte {position}"
        assert {fault.shard for fault in faults} == {"train/00000.npz"}


@pytest.mark.parametrize("length", [0, 10, 5000, -1])
def test_a_cut_shard_is_one_fault(dataset_path: Path, length: int) -> None:
    shard = dataset_path / "train" / "00000.npz"
    shard.write_bytes(shard.read_bytes()[:length])
    (fault,) = verify_dataset(dataset_path)
    assert (fault.shard, fault.column) == ("train/00000.npz", None)


def test_a_missing_shard_does_not_hide_other_faults(dataset_path: Path) -> None:
    (dataset_path / "train" / "00000.npz").unlink()
    (dataset_path / "train" / "00016.npz").unlink()
    faults = verify_dataset(dataset_path)
    assert [fault.shard for fault in faults] == ["train/00000.npz", "train/00016.npz"]


def test_arrays_added_and_removed_are_named(dataset_path: Path) -> None:
    shard = dataset_path / "train" / "00000.npz"
    arrays = map_npz(shard)
    points = arrays.pop("points")
    write_npz(shard, arrays | {"extra": points})
    assert {fault.column for fault in verify_dataset(dataset_path)} == {None, "extra", "points"}


def test_a_manifest_changed_by_hand_is_refused(dataset_path: Path) -> None:
    manifest = dataset_path / "dataset.json"
    manifest.write_text(manifest.read_text().replace('"monday"', '"friday"'))
    with pytest.raises(ShardError, match="changed by hand or damaged"):
        verify_dataset(dataset_path)
