from __future__ import annotations

from itertools import islice

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from graspe_data.errors import ShardError
from graspe_data.shards.epoch_order import EpochOrder, Step, Tail, epoch_permutation

SIZES = st.integers(1, 60)


def all_ranks(
    rows: int, batch: int, world: int, position: int = 0, tail: Tail = "keep"
) -> list[list[Step]]:
    """The steps of one epoch, for each step those of all ranks."""
    orders = [EpochOrder(rows, "d", 3, batch, rank, world, tail) for rank in range(world)]
    return [
        list(steps)
        for steps in zip(*(order.epoch_steps(position) for order in orders), strict=True)
    ]


def together(steps: list[Step]) -> NDArray[np.int64]:
    """The samples of a step in their sequence, back from the ranks."""
    found = np.full((max(step.indices.size for step in steps), len(steps)), -1)
    for rank, step in enumerate(steps):
        found[: step.indices.size, rank] = step.indices
    return found[found >= 0]


def test_the_permutation_is_the_same_for_ever() -> None:
    assert epoch_permutation(0, 0, "digest", 10).tolist() == [5, 6, 7, 0, 4, 2, 3, 9, 1, 8]


@given(rows=st.integers(0, 300), seed=st.integers(), epoch=st.integers(0, 9))
def test_an_epoch_is_a_permutation(rows: int, seed: int, epoch: int) -> None:
    order = epoch_permutation(seed, epoch, "digest", rows)
    assert np.array_equal(np.sort(order), np.arange(rows))


def test_seed_epoch_and_digest_each_change_the_order() -> None:
    orders = {
        epoch_permutation(seed, epoch, digest, 100).tobytes()
        for seed in range(3)
        for epoch in range(3)
        for digest in "ab"
    }
    assert len(orders) == 18


def test_every_place_is_equally_likely() -> None:
    """Chi-square of the place of each row over 2,000 seeds, 99 degrees of freedom."""
    counts = np.zeros((10, 10))
    for seed in range(2000):
        counts[np.arange(10), epoch_permutation(seed, 0, "d", 10)] += 1
    assert ((counts - 200) ** 2 / 200).sum() < 150


@given(rows=SIZES, batch=st.integers(1, 9), world=st.integers(1, 5))
def test_each_row_comes_once_an_epoch_over_all_ranks(rows: int, batch: int, world: int) -> None:
    steps = all_ranks(rows, batch, world)
    seen = np.concatenate([rank.indices for step in steps for rank in step])
    assert np.array_equal(np.sort(seen), np.arange(rows))
    assert steps[-1][0].next_position == rows


@given(rows=SIZES, shared=st.sampled_from([(6, 1), (3, 2), (2, 3), (1, 6)]))
def test_steps_do_not_depend_on_how_many_ranks_share_them(
    rows: int, shared: tuple[int, int]
) -> None:
    alone = [together(step).tolist() for step in all_ranks(rows, 6, 1)]
    assert [together(step).tolist() for step in all_ranks(rows, *shared)] == alone


@given(rows=SIZES, batch=st.integers(1, 9), world=st.integers(1, 5), stop=st.integers(0, 20))
def test_resumed_with_other_ranks_each_row_still_comes_once(
    rows: int, batch: int, world: int, stop: int
) -> None:
    before = all_ranks(rows, 4, 2)[: stop + 1]
    position = before[-1][0].next_position
    after = all_ranks(rows, batch, world, position) if position < rows else []
    seen = np.concatenate([rank.indices for step in [*before, *after] for rank in step])
    assert np.array_equal(np.sort(seen), np.arange(rows))


@given(rows=SIZES, batch=st.integers(1, 9), stop=st.integers(0, 100))
def test_one_integer_resumes_the_same_sequence(rows: int, batch: int, stop: int) -> None:
    order = EpochOrder(rows, "d", 0, batch)

    def walk(position: int) -> list[list[int]]:
        walked: list[list[int]] = []
        while len(walked) < 12:
            for step in order.epoch_steps(position):
                walked.append([step.next_position, *step.indices.tolist()])
                position = step.next_position
        return walked[:12]

    whole = walk(0)
    k = stop % 11
    assert walk(whole[k][0])[: 11 - k] == whole[k + 1 :]


@given(rows=SIZES, batch=st.integers(1, 9), world=st.integers(1, 5))
def test_padded_ranks_have_equally_many(rows: int, batch: int, world: int) -> None:
    steps = all_ranks(rows, batch, world, tail="pad")
    assert {rank.indices.size for step in steps for rank in step} == {batch}
    seen = np.concatenate([rank.indices for step in steps for rank in step])
    assert np.array_equal(np.unique(seen), np.arange(rows))
    assert steps[-1][0].next_position == rows


@given(rows=SIZES, batch=st.integers(1, 9), world=st.integers(1, 5), epoch=st.integers(0, 3))
def test_dropped_tails_leave_full_steps_without_repeats(
    rows: int, batch: int, world: int, epoch: int
) -> None:
    if rows < batch * world:
        with pytest.raises(ShardError, match="do not fill one step"):
            all_ranks(rows, batch, world, tail="drop")
        return
    steps = all_ranks(rows, batch, world, epoch * rows, "drop")
    seen = np.concatenate([rank.indices for step in steps for rank in step])
    assert len(steps) == rows // (batch * world)
    assert np.unique(seen).size == seen.size == len(steps) * batch * world
    assert steps[-1][0].next_position == (epoch + 1) * rows


def test_a_tail_too_short_after_a_resume_is_dropped() -> None:
    order = EpochOrder(10, "d", batch_size=4, tail="drop")
    assert order.epoch_of(7) == 1
    assert next(order.epoch_steps(7)).next_position == 14


def test_another_dataset_is_refused() -> None:
    order = EpochOrder(10, "a" * 64)
    order.check_digest("a" * 64)
    with pytest.raises(ShardError, match="saved with dataset bbbbbbbbbbbbbbbb, this one is aaaa"):
        order.check_digest("b" * 64)


@pytest.mark.parametrize(
    "wrong", [{"rank": 2, "world_size": 2}, {"rank": -1}, {"batch_size": 0}, {"rows": 0}]
)
def test_senseless_settings_are_refused(wrong: dict[str, int]) -> None:
    with pytest.raises(ShardError):
        EpochOrder(**({"rows": 10} | wrong), digest="d")  # type: ignore[arg-type]


def test_a_negative_position_is_refused() -> None:
    with pytest.raises(ShardError, match="0 or more"):
        list(islice(EpochOrder(10, "d").epoch_steps(-1), 1))
