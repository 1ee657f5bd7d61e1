"""Blocks of time of few recordings: shares kept, nothing that a row looks at in two splits."""

from __future__ import annotations

from itertools import combinations
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import ValidationError

from graspe_data.arrays import Stamps
from graspe_data.errors import ShardError, StageError, ZooError
from graspe_data.progress import Silent
from graspe_data.shards import Dataset
from graspe_data.shards.dataset_index import DatasetIndex, read_index
from graspe_data.shards.verify import verify_dataset
from graspe_data.simulation.motion.drivers import Leg
from model_zoo.checkpoints.lineage import Lineage
from model_zoo.split_leaks import check_apart
from pipelines.build import build_dataset
from pipelines.dataset_settings import DatasetManifest, DatasetRecipe, SplitSettings, TimeSplit
from pipelines.executors import Workers
from pipelines.rederive import rederive_rows
from pipelines.report.row_at import find_row
from pipelines.time_blocks import GUARDED, SPLITS, TimeBlocks, plan_blocks
from tests.pipelines.conftest import RecordingFactory

SECOND = 1_000_000_000
START = 1_700_000_000_123_456_789
WHOLE_BLOCK = START // (60 * SECOND) * 60 * SECOND


def manifest(block_s: float = 60.0, guard_s: float = 10.0, **more: Any) -> DatasetManifest:
    split = {"by_time": {"block_s": block_s, "guard_s": guard_s}, **more}
    return DatasetManifest.model_validate({"name": "few", "robot": "spot", "split": split})


def anchors(seconds: float, rate: float = 5.0, start: int = START) -> Stamps:
    since: Stamps = (np.arange(round(seconds * rate)) / rate * 1e9).astype(np.int64)
    return start + since


def planned(stamps: Stamps, few: DatasetManifest, name: str = "drive") -> TimeBlocks:
    assert few.split.by_time is not None
    return plan_blocks([stamps], name, few.split.by_time, few)


@settings(max_examples=40, deadline=None)
@given(
    st.floats(400, 4000),
    st.floats(25, 120),
    st.floats(0, 10),
    st.text(min_size=1, max_size=5),
    st.integers(0, 2**61),
)
def test_no_row_looks_at_what_a_row_of_another_split_looks_at(
    seconds: float, block_s: float, guard_s: float, name: str, start: int
) -> None:
    few, stamps = manifest(block_s, guard_s), anchors(seconds, start=start)
    blocks = planned(stamps, few, name)
    rows = {split: blocks.rows_of(stamps, split) for split in SPLITS}
    together = np.sort(np.concatenate([*rows.values()]))
    assert len(np.unique(together)) == len(together) == len(stamps) - blocks.guarded(stamps)
    back, ahead = round(few.looks_back_s * 1e9), round(few.looks_ahead_s * 1e9)
    for one, other in combinations(SPLITS, 2):
        mine, theirs = stamps[rows[one]], stamps[rows[other]]
        if mine.size and theirs.size:
            apart = np.abs(mine[:, None] - theirs[None])
            assert apart.min() >= back + ahead + round(guard_s * 1e9) - 4


@settings(max_examples=40, deadline=None)
@given(st.integers(3, 200), st.tuples(st.floats(0.2, 1), st.floats(0.05, 1), st.floats(0.05, 1)))
def test_each_split_has_its_share_of_the_blocks(
    number: int, weights: tuple[float, float, float]
) -> None:
    shares = dict(zip(SPLITS, (np.array(weights) / sum(weights)).tolist(), strict=True))
    blocks = planned(anchors(60 * number, 1.0, WHOLE_BLOCK), manifest(**shares))
    assert len(blocks.number) == number
    for place, split in enumerate(SPLITS):
        found = int((blocks.split == place).sum())
        assert found >= 1
        assert abs(found - shares[split] * number) <= 2


def test_the_draw_follows_from_name_and_seed() -> None:
    few, stamps = manifest(), anchors(1800)
    one, same, other = (planned(stamps, few, name) for name in ("a", "a", "b"))
    np.testing.assert_array_equal(one.split, same.split)
    assert not np.array_equal(one.split, other.split)
    reseeded = few.model_copy(update={"seed": 1})
    assert not np.array_equal(one.split, planned(stamps, reseeded, "a").split)


def test_recordings_of_one_drive_share_its_blocks() -> None:
    few, whole = manifest(), anchors(1800)
    assert few.split.by_time is not None
    parts = [whole[:4000], whole[3000:]]
    blocks = plan_blocks(parts, "drive", few.split.by_time, few)
    np.testing.assert_array_equal(blocks.split, planned(whole, few).split)
    for split in SPLITS:
        both = [set(part[blocks.rows_of(part, split)].tolist()) for part in parts]
        assert both[0] | both[1] == set(whole[blocks.rows_of(whole, split)].tolist())


def test_spans_join_blocks_that_follow_one_another() -> None:
    blocks = TimeBlocks(10, 1, 1, np.array([3, 4, 5, 9]), np.array([0, 0, 1, 0]))
    assert blocks.spans_ns("train") == [(30, 50), (90, 100)]
    assert blocks.spans_ns("validation") == [(50, 60)]
    assert blocks.spans_ns("test") == []


def test_between_blocks_of_one_split_nothing_is_lost() -> None:
    stamps = np.arange(30, 100)
    blocks = TimeBlocks(10, 3, 2, np.arange(3, 10), np.array([0, 0, 0, 1, 1, 0, 0]))
    assert stamps[blocks.rows_of(stamps, "train")].tolist() == [*range(30, 58), *range(83, 100)]
    assert stamps[blocks.rows_of(stamps, "validation")].tolist() == [*range(63, 78)]
    assert blocks.guarded(stamps) == 10


def test_a_drive_with_too_few_blocks_is_refused() -> None:
    stamps = anchors(110, start=WHOLE_BLOCK)
    with pytest.raises(StageError, match="rows in 2 blocks of 60 s, and 3 splits have a share"):
        planned(stamps, manifest())
    assert len(planned(stamps, manifest(train=0.5, validation=0, test=0.5)).number) == 2


def test_blocks_in_which_no_row_fits_are_refused() -> None:
    with pytest.raises(ValidationError, match=r"block of 18 s .* history, horizon and tolerances"):
        manifest(18.0)
    assert manifest(18.0, 5.0).split.by_time == TimeSplit(block_s=18.0, guard_s=5.0)


@pytest.fixture(scope="module")
def legs() -> tuple[Leg, ...]:
    """To and fro for half a minute."""
    return (Leg(2.5, 0.4, 0.3), Leg(2.5, -0.4, 0.3)) * 6


@pytest.fixture
def few(recipe: DatasetRecipe) -> DatasetRecipe:
    """Half for training, a quarter each for the others, in blocks of five seconds."""
    by_time = TimeSplit(block_s=5.0, guard_s=0.2)
    split = SplitSettings(train=0.5, validation=0.25, test=0.25, by_time=by_time)
    dataset = recipe.dataset.model_dump() | {"split": split.model_dump()}
    return DatasetRecipe(dataset=DatasetManifest.model_validate(dataset), robot=recipe.robot)


def test_one_recording_makes_a_dataset_with_all_splits(
    record: RecordingFactory, few: DatasetRecipe, legs: tuple[Leg, ...], tmp_path: Any
) -> None:
    folder, recording = tmp_path / "dataset", record("long", legs=legs)
    index = build_dataset(few, [recording], folder, Workers(), Silent()).index
    assert verify_dataset(folder) == []
    assert {entry.split for entry in index.recordings} == set(SPLITS)
    assert len({entry.digest for entry in index.recordings}) == 1
    assert index.losses[GUARDED] > 0
    stamps: dict[str, Stamps] = {}
    for number, entry in enumerate(index.recordings):
        assert entry.split is not None
        rows = Dataset(folder, entry.split)
        batch = rows.batch(np.arange(len(rows)))
        assert len(rows) == entry.rows
        assert set(batch["recording"].tolist()) == {number}
        stamps[entry.split] = batch["stamp_ns"].astype(np.int64)
        for stamp in batch["stamp_ns"].tolist():
            assert any(start <= stamp < stop for start, stop in entry.blocks_ns)
    need = round((few.dataset.looks_back_s + few.dataset.looks_ahead_s + 0.2) * 1e9)
    for one, other in combinations(SPLITS, 2):
        assert np.abs(stamps[one][:, None] - stamps[other][None]).min() >= need - 4
    # It is proven and found like any other.
    proof = rederive_rows(folder, [recording], 12, 0)
    assert (proof.rows, proof.faults, proof.not_given) == (12, (), ())
    second = (int(stamps["test"][0]) - int(index.recordings[0].details["time_zero_ns"])) / 1e9  # type: ignore[arg-type]
    assert find_row(folder, recording.name, second).split == "test"
    check_leaks(index)


def check_leaks(index: DatasetIndex) -> None:
    """Its own test blocks may be examined; the whole recording, or blocks that overlap, not."""
    check_apart(index.recordings, index.recordings, "test", None)  # type: ignore[arg-type]
    lineage = Lineage.of(index, 1)
    lineage.check_unseen(index, "test", "here", own=True)
    with pytest.raises(ZooError, match="were in the train split"):
        lineage.check_unseen(index, "test", "elsewhere")
    whole = [
        entry.model_copy(update={"details": {"content": entry.details["content"]}})
        for entry in index.recordings
    ]
    with pytest.raises(ZooError, match="have the same bytes"):
        check_apart(index.recordings, whole, "test", None)  # type: ignore[arg-type]


def test_an_index_whose_splits_share_time_is_none(
    record: RecordingFactory, few: DatasetRecipe, legs: tuple[Leg, ...], tmp_path: Any
) -> None:
    folder = tmp_path / "dataset"
    index = build_dataset(few, [record("long", legs=legs)], folder, Workers(), Silent()).index
    one, other, *rest = index.recordings
    shared = other.model_copy(update={"details": {**other.details, "blocks_ns": [[0, 1 << 62]]}})
    with pytest.raises(ValidationError, match="is in the splits"):
        DatasetIndex.model_validate(
            index.model_dump()
            | {"recordings": [each.model_dump() for each in (one, shared, *rest)]}
        )
    assert read_index(folder) == index


def test_a_recording_too_short_for_its_blocks_is_named(
    record: RecordingFactory, few: DatasetRecipe, tmp_path: Any
) -> None:
    with pytest.raises(StageError, match=r"drive: has rows in \d blocks of 5 s, and 3 splits"):
        build_dataset(few, [record()], tmp_path / "dataset", Workers(), Silent())
    with pytest.raises(ShardError, match="no finished dataset"):
        read_index(tmp_path / "dataset")


def test_a_group_with_a_split_stays_whole(
    record: RecordingFactory, few: DatasetRecipe, legs: tuple[Leg, ...], tmp_path: Any
) -> None:
    groups = [{"name": "kept", "recordings": ["kept*"], "split": "test"}]
    split = few.dataset.split.model_dump() | {"groups": groups}
    dataset = DatasetManifest.model_validate(few.dataset.model_dump() | {"split": split})
    recordings = [record("long", legs=legs), record("kept", seed=3)]
    made = build_dataset(
        DatasetRecipe(dataset=dataset, robot=few.robot),
        recordings,
        tmp_path / "d",
        Workers(),
        Silent(),
    )
    kept = [entry for entry in made.index.recordings if entry.name == "kept"]
    assert [(entry.split, entry.blocks_ns) for entry in kept] == [("test", [])]
