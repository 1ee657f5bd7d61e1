"""The order of the rows in an epoch: a pure function of seed, epoch and dataset digest."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from graspe_data.errors import ShardError

Tail = Literal["keep", "drop", "pad"]


def epoch_permutation(seed: int, epoch: int, digest: str, rows: int) -> NDArray[np.int64]:
    """A permutation of 0 .. rows - 1, the same on every machine and with every numpy.

    Rows are sorted by a 64-bit draw each from Philox, whose stream numpy keeps fixed, under a key
    that is the SHA-256 of the arguments.

    Args:
        seed: Chosen by the user.
        epoch: Counted from 0.
        digest: ``Dataset.digest``.
        rows: Rows of the split.
    """
    text = f"graspe epoch order 1\0{seed}\0{epoch}\0{digest}\0{rows}"
    key = int.from_bytes(hashlib.sha256(text.encode()).digest()[:16], "little")
    draws = np.random.Philox(key=key).random_raw(rows)
    return np.argsort(draws, kind="stable").astype(np.int64, copy=False)


@dataclass(frozen=True)
class Step:
    """One batch of one rank.

    Attributes:
        epoch: Counted from 0.
        indices: Rows of this rank, (batch_size,) or fewer at the end of an epoch.
        next_position: Samples consumed by all ranks after this step: the state to resume from.
    """

    epoch: int
    indices: NDArray[np.int64]
    next_position: int


@dataclass(frozen=True)
class EpochOrder:
    """Who reads which rows when.

    All ranks walk one sequence of samples, the permutations of epoch 0, 1, ... in turn, in steps of
    ``batch_size * world_size``; of each step rank r takes every ``world_size``-th sample from the
    r-th on. So the rows of a step do not depend on how many ranks share it, nor on workers or
    shards, and a position in the sequence is all there is to resume, with any number of ranks.

    Attributes:
        rows: Rows of the split.
        digest: ``Dataset.digest``.
        seed: Seed of the permutations.
        batch_size: Rows a rank and a step.
        rank: This process, in 0 .. world_size - 1.
        world_size: Processes that share an epoch.
        tail: The last step of an epoch, where rows do not fill it. ``keep``: every row exactly
            once; ranks get up to one row fewer than others, perhaps none. ``drop``: left out, every
            step is full and no row comes twice. ``pad``: filled with rows from the beginning of
            the epoch, so that all ranks have equally many.

    Raises:
        ShardError: A rank, batch size or number of rows that makes no sense.
    """

    rows: int
    digest: str
    seed: int = 0
    batch_size: int = 1
    rank: int = 0
    world_size: int = 1
    tail: Tail = "keep"

    def __post_init__(self) -> None:
        """Refuse what cannot be ordered."""
        if not 0 <= self.rank < self.world_size:
            raise ShardError(f"rank {self.rank} is not in 0..{self.world_size - 1}.")
        if self.batch_size < 1 or self.rows < 1:
            raise ShardError(
                f"batch size {self.batch_size} and rows {self.rows}: expected at least 1 of each."
            )
        if self.tail == "drop" and self.rows < self.step_size:
            raise ShardError(
                f"{self.rows} rows do not fill one step of {self.step_size}, and tail is 'drop': "
                "take smaller batches, fewer ranks, or tail 'keep' or 'pad'."
            )

    @property
    def step_size(self) -> int:
        """Samples that all ranks take in a full step."""
        return self.batch_size * self.world_size

    def epoch_of(self, position: int) -> int:
        """The epoch that the step after ``position`` samples belongs to."""
        epoch, done = divmod(self._checked(position), self.rows)
        return epoch + (self.tail == "drop" and self.rows - done < self.step_size)

    def epoch_steps(self, position: int = 0) -> Iterator[Step]:
        """The steps of this rank from ``position`` to the end of its epoch.

        Args:
            position: ``next_position`` of the last step done, by any number of ranks.

        Raises:
            ShardError: ``position`` is negative.
        """
        epoch = self.epoch_of(position)
        end = (epoch + 1) * self.rows
        position = max(position, epoch * self.rows)
        order = epoch_permutation(self.seed, epoch, self.digest, self.rows)
        while position < end:
            begin = position - epoch * self.rows
            samples = order[begin : begin + self.step_size]
            position = min(position + self.step_size, end)
            if self.tail == "drop" and end - position < self.step_size:
                position = end
            if self.tail == "pad" and samples.size < self.step_size:
                samples = np.append(samples, np.resize(order, self.step_size - samples.size))
            yield Step(epoch, samples[self.rank :: self.world_size], position)

    def check_digest(self, digest: str) -> None:
        """Refuse a state that was saved with another dataset; where it lies does not matter.

        Raises:
            ShardError: Names both digests.
        """
        if digest != self.digest:
            raise ShardError(
                f"the state to resume was saved with dataset {digest:.16}, this one is "
                f"{self.digest:.16}: its rows or their order differ. Resume with the dataset of "
                "then, or start a new run."
            )

    def _checked(self, position: int) -> int:
        if position < 0:
            raise ShardError(f"position {position}: expected the samples consumed, 0 or more.")
        return position
