from __future__ import annotations

import gc
import multiprocessing
import shutil
import time
import weakref
from collections.abc import Callable, Iterable
from itertools import chain, islice
from pathlib import Path

import pytest
import torch

from graspe_data.errors import ShardError
from graspe_data.shards import Dataset
from model_zoo.batches import Batch, BatchLoader

Build = Callable[..., Path]


def rows_of(batches: Iterable[Batch]) -> list[list[int]]:
    return [batch["row"].tolist() for batch in batches]


def test_batches_are_tensors_of_the_columns_own_dtype(build_dataset: Build) -> None:
    batch = next(iter(BatchLoader(Dataset(build_dataset(), "train"), 4)))
    assert batch["image"].dtype == torch.uint8
    assert batch["image"].shape == (4, 4, 6, 3)
    assert batch["success"].dtype == torch.bool
    assert torch.equal(batch["image"][:, 0, 0, 0].long(), batch["row"])


def test_each_iteration_is_an_epoch_in_another_order(build_dataset: Build) -> None:
    loader = BatchLoader(Dataset(build_dataset(), "train"), 4)
    epochs = [list(chain.from_iterable(rows_of(loader))) for _ in range(3)]
    assert all(sorted(epoch) == list(range(23)) for epoch in epochs)
    assert epochs[0] != epochs[1] != epochs[2]
    assert (loader.epoch, loader.state(), len(loader)) == (3, 69, 6)


def test_workers_change_nothing(build_dataset: Build) -> None:
    dataset = Dataset(build_dataset(), "train")
    alone, helped = (BatchLoader(dataset, 4, seed=5, workers=workers) for workers in (0, 2))
    assert [rows_of(alone), rows_of(alone)] == [rows_of(helped), rows_of(helped)]


def test_state_counts_what_was_taken_not_what_was_read_ahead(build_dataset: Build) -> None:
    dataset = Dataset(build_dataset(), "train")
    whole = rows_of(BatchLoader(dataset, 4))
    loader = BatchLoader(dataset, 4, workers=1)
    begun = rows_of(islice(loader, 2))
    assert loader.state() == 8
    assert begun + rows_of(loader) == whole


def test_a_run_is_resumed_by_one_integer_after_a_move(build_dataset: Build, tmp_path: Path) -> None:
    dataset = Dataset(build_dataset(), "train")
    loader = BatchLoader(dataset, 4)
    rows_of(loader)
    rows_of(islice(loader, 3))
    state, digest = loader.state(), dataset.digest
    rest = [rows_of(loader), rows_of(loader)]
    shutil.move(dataset.path, tmp_path / "moved")
    resumed = BatchLoader(Dataset(tmp_path / "moved", "train"), 4)
    resumed.resume(state, digest)
    assert resumed.epoch == 1
    assert [rows_of(resumed), rows_of(resumed)] == rest


def test_ranks_share_an_epoch_and_may_become_fewer(build_dataset: Build) -> None:
    dataset = Dataset(build_dataset(24), "train")
    three = [BatchLoader(dataset, 2, rank=rank, world_size=3) for rank in range(3)]
    seen = [rows_of(islice(loader, 2)) for loader in three]
    assert {loader.state() for loader in three} == {12}
    two = [BatchLoader(dataset, 3, rank=rank, world_size=2) for rank in range(2)]
    for loader in two:
        loader.resume(12, dataset.digest)
    seen += [rows_of(loader) for loader in two]
    assert sorted(row for rank in seen for batch in rank for row in batch) == list(range(24))


@pytest.mark.parametrize(("tail", "batches", "rows"), [("drop", 2, 20), ("pad", 3, 30)])
def test_under_drop_and_pad_all_ranks_have_full_batches(
    build_dataset: Build, tail: str, batches: int, rows: int
) -> None:
    dataset = Dataset(build_dataset(), "train")
    loaders = [
        BatchLoader(dataset, 5, rank=rank, world_size=2, tail=tail)  # type: ignore[arg-type]
        for rank in range(2)
    ]
    found = [rows_of(loader) for loader in loaders]
    assert [len(rank) for rank in found] == [batches] * 2 == [len(loader) for loader in loaders]
    assert sum(len(batch) for rank in found for batch in rank) == rows


def test_the_shards_layout_changes_nothing(build_dataset: Build) -> None:
    orders = [
        rows_of(BatchLoader(Dataset(build_dataset(23, size, f"by{size}"), "train"), 4))
        for size in (1, 7, 100)
    ]
    assert orders[0] == orders[1] == orders[2]


def test_another_dataset_is_refused(build_dataset: Build) -> None:
    first = Dataset(build_dataset(23, name="first"), "train")
    second = BatchLoader(Dataset(build_dataset(24, name="second"), "train"), 4)
    with pytest.raises(ShardError, match="the state to resume was saved with dataset"):
        second.resume(8, first.digest)


def test_a_loader_that_is_dropped_takes_its_workers_along_at_once(build_dataset: Build) -> None:
    loader = BatchLoader(Dataset(build_dataset(), "train"), 4, workers=2)
    rows_of(islice(loader, 2))
    workers = multiprocessing.active_children()
    assert len(workers) == 2
    dropped = weakref.ref(loader)
    gc.disable()
    try:
        begin = time.monotonic()
        del loader
        assert dropped() is None
        assert time.monotonic() - begin < 2
        assert not any(worker.is_alive() for worker in workers)
    finally:
        gc.enable()
