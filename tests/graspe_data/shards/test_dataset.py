from __future__ import annotations

import hashlib
import os
import pickle
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from graspe_data.errors import ShardError
from graspe_data.shards import Dataset
from graspe_data.shards.aligned_npz import NpzMap, map_npz, write_npz
from graspe_data.shards.dataset_index import read_index, write_index
from graspe_data.shards.verify import verify_dataset

Arrays = dict[str, NDArray[np.generic]]


def same(found: Arrays, expected: Arrays) -> bool:
    return found.keys() == expected.keys() and all(
        found[name].dtype == array.dtype and np.array_equal(found[name], array)
        for name, array in expected.items()
    )


def test_every_row_comes_back_decoded(dataset_path: Path, rows: Arrays) -> None:
    dataset = Dataset(dataset_path, "train")
    assert len(dataset) == 23
    for index in range(len(dataset)):
        assert same(dataset.row(index), {name: array[index] for name, array in rows.items()})


def test_a_batch_has_the_rows_in_the_order_asked_for(dataset_path: Path, rows: Arrays) -> None:
    indices = np.array([22, 0, 7, 8, 7, 15, 16, 1])
    batch = Dataset(dataset_path, "train").batch(indices)
    assert same(batch, {name: array[indices] for name, array in rows.items()})


def test_a_batch_of_no_rows_is_empty(dataset_path: Path, rows: Arrays) -> None:
    batch = Dataset(dataset_path, "train").batch([])
    assert same(batch, {name: array[:0] for name, array in rows.items()})


def test_undecoded_rows_come_as_stored(dataset_path: Path) -> None:
    dataset = Dataset(dataset_path, "train", ["image", "drawing"], decode=False)
    batch = dataset.batch([9, 3])
    assert batch["drawing"].shape == (2, 6, 3)
    begin, middle, end = batch["image.offsets"].tolist()
    assert (begin, end) == (0, batch["image.bytes"].size)
    assert batch["image.bytes"][middle : middle + 4].tobytes() == b"\x89PNG"
    assert dataset.row(9)["image.bytes"].size == middle


def test_only_columns_asked_for_are_touched(
    dataset_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    touched: list[str] = []
    array = NpzMap.array

    def spy(mapped: NpzMap, name: str) -> NDArray[np.generic]:
        touched.append(name)
        return array(mapped, name)

    monkeypatch.setattr(NpzMap, "array", spy)
    dataset = Dataset(dataset_path, "train", ["velocity"])
    assert touched == []
    assert dataset.row(3).keys() == {"velocity"}
    assert dataset.batch([1, 2, 9]).keys() == {"velocity"}
    assert touched == ["velocity", "velocity"]


@pytest.mark.parametrize("index", [-1, 23, 1 << 40])
def test_a_row_out_of_range_is_an_index_error(dataset_path: Path, index: int) -> None:
    dataset = Dataset(dataset_path, "train")
    for ask in (dataset.row, lambda row: dataset.batch([3, row])):
        with pytest.raises(IndexError, match=rf"row {index} is not in 0\.\.22"):
            ask(index)


def test_a_split_without_rows_says_so(dataset_path: Path) -> None:
    index = read_index(dataset_path)
    splits: dict[str, Any] = {**index.splits, "test": []}
    write_index(dataset_path, index.model_copy(update={"splits": splits}))
    dataset = Dataset(dataset_path, "test")
    for ask in (dataset.row, lambda row: dataset.batch([row])):
        with pytest.raises(IndexError, match="row 0: the split 'test' has no rows"):
            ask(0)


def test_a_pickled_dataset_opens_its_files_again(dataset_path: Path, rows: Arrays) -> None:
    dataset = Dataset(dataset_path, "train", ["row"])
    dataset.row(0)
    content = pickle.dumps(dataset)
    assert len(content) < 20_000
    assert pickle.loads(content).row(20)["row"] == 20  # noqa: S301


def test_forks_and_threads_share_a_dataset(dataset_path: Path) -> None:
    dataset = Dataset(dataset_path, "train", ["row", "points"])
    found: list[bool] = []

    def read(seed: int) -> None:
        indices = np.random.default_rng(seed).integers(0, 23, 200).tolist()
        found.extend(int(dataset.row(index)["row"]) == index for index in indices)

    threads = [threading.Thread(target=read, args=(seed,)) for seed in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(found) == 800
    assert all(found)
    child = os.fork()
    if not child:
        os._exit(0 if dataset.row(11)["row"] == 11 else 1)
    assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 0


def test_more_shards_than_open_files_allow(
    build: Callable[[int, str], Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("graspe_data.shards.dataset._half_of_open_files", lambda: 3)
    dataset = Dataset(build(1, "single"), "train", ["row"])
    indices = np.random.default_rng(0).permutation(23)
    assert np.array_equal(dataset.batch(indices)["row"], indices)
    assert len(dataset._mapped) <= 3


def test_the_digest_is_of_the_rows_not_of_the_layout(build: Callable[[int, str], Path]) -> None:
    datasets = [Dataset(build(size, f"by{size}"), "train") for size in (1, 5, 100)]
    assert len({dataset.digest for dataset in datasets}) == 1
    assert len({dataset.batch(range(23))["points"].tobytes() for dataset in datasets}) == 1


def test_an_unknown_split_or_column_lists_those_there_are(dataset_path: Path) -> None:
    with pytest.raises(ShardError, match="no split 'val'; the dataset has test, train"):
        Dataset(dataset_path, "val")
    with pytest.raises(ShardError, match="no column 'picture'; it has image, points"):
        Dataset(dataset_path, "train", ["picture"])


def test_a_shard_of_another_size_is_refused(dataset_path: Path) -> None:
    shard = dataset_path / "train" / "00008.npz"
    shard.write_bytes(shard.read_bytes()[:-1])
    dataset = Dataset(dataset_path, "train")
    assert dataset.row(0)["row"] == 0
    with pytest.raises(ShardError, match=r"00008\.npz"):
        dataset.row(8)


def test_a_missing_shard_is_named(dataset_path: Path) -> None:
    (dataset_path / "train" / "00000.npz").unlink()
    with pytest.raises(ShardError, match=r"00000\.npz: cannot be opened: No such file"):
        Dataset(dataset_path, "train").row(0)


def test_a_shard_with_another_shape_is_refused(dataset_path: Path, rows: Arrays) -> None:
    shard = dataset_path / "train" / "00000.npz"
    arrays = map_npz(shard)
    write_npz(shard, arrays | {"points": np.swapaxes(arrays["points"], 1, 2)})
    with pytest.raises(ShardError, match=r"points: expected float32 \(8, 300, 3\), found float32"):
        Dataset(dataset_path, "train").row(0)


@pytest.mark.parametrize("check", ["crc", "sha256"])
def test_contents_are_checked_when_asked(dataset_path: Path, check: str) -> None:
    shard = dataset_path / "train" / "00000.npz"
    points = map_npz(shard)["points"].tobytes()
    content = bytearray(shard.read_bytes())
    content[content.find(points) + 1000] ^= 4
    shard.write_bytes(content)
    assert Dataset(dataset_path, "train").row(0)["row"] == 0
    with pytest.raises(ShardError, match="points: its"):
        Dataset(dataset_path, "train", check=check).row(0)  # type: ignore[arg-type]


def test_a_link_out_of_the_folder_is_refused(dataset_path: Path, tmp_path: Path) -> None:
    shard = dataset_path / "train" / "00000.npz"
    shard.rename(tmp_path / "elsewhere.npz")
    shard.symlink_to(tmp_path / "elsewhere.npz")
    with pytest.raises(ShardError, match=r"a link to .*elsewhere\.npz, which lies out of"):
        Dataset(dataset_path, "train").row(0)
    faults = verify_dataset(dataset_path)
    assert [fault.shard for fault in faults] == ["train/00000.npz"]
    assert "GRASPE_LINKS=" in faults[0].found


def hub_layout(dataset_path: Path, cache: Path) -> Path:
    """The files as a hub's cache lays them: under their digest, and links of their names."""
    repository = cache / "datasets--group--drives"
    folder = repository / "snapshots" / "0a1b" / "dataset"
    (repository / "blobs").mkdir(parents=True)
    for file in sorted(path for path in dataset_path.rglob("*") if path.is_file()):
        blob = repository / "blobs" / hashlib.sha256(file.read_bytes()).hexdigest()
        blob.write_bytes(file.read_bytes())
        link = folder / file.relative_to(dataset_path)
        link.parent.mkdir(parents=True, exist_ok=True)
        link.symlink_to(os.path.relpath(blob, link.parent))
    return folder


def test_a_dataset_in_a_hubs_cache_is_read_and_its_digests_are_checked(
    dataset_path: Path, tmp_path: Path
) -> None:
    folder = hub_layout(dataset_path, tmp_path / "hub")
    assert verify_dataset(folder) == []
    found = Dataset(folder, "train", check="sha256").batch(range(23))
    plain = Dataset(dataset_path, "train").batch(range(23))
    assert all(np.array_equal(found[name], plain[name]) for name in plain)
    blob = (folder / "train" / "00008.npz").resolve()
    content = bytearray(blob.read_bytes())
    content[len(content) // 2] ^= 1
    blob.write_bytes(content)
    assert [fault.shard for fault in verify_dataset(folder)] == ["train/00008.npz"]
    with pytest.raises(ShardError, match="its sha256 does not match"):
        list(Dataset(folder, "train", check="sha256").check_shards())
