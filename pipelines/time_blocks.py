"""Few recordings, split by blocks of time: which rows of a drive go to which split."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from graspe_data.arrays import Mask, Stamps
from graspe_data.errors import StageError
from pipelines.dataset_settings import DatasetManifest, Split, SplitSettings, TimeSplit

SPLITS: tuple[Split, ...] = ("train", "validation", "test")
GUARDED = "what it looks at lies in two splits, or in the guard between them"
_FAR = 1 << 62
"""ns, before and after everything."""


@dataclass(frozen=True)
class TimeBlocks:
    """The blocks of one drive, all of its recordings together.

    Attributes:
        block_ns: Length of a block; block k holds the stamps from k block_ns on.
        before_ns: What a row looks at before its anchor, and half of the guard.
        after_ns: What it looks at after its anchor, and half of the guard.
        number: Of each block that holds rows, int64 (K,), rising.
        split: Of each, the place of its split in ``SPLITS``, int64 (K,).
    """

    block_ns: int
    before_ns: int
    after_ns: int
    number: NDArray[np.int64]
    split: NDArray[np.int64]

    def rows_of(self, stamps_ns: Stamps, split: Split) -> NDArray[np.intp]:
        """The rows of a split, by their anchors int64 (R,): all that they look at lies in it."""
        return np.flatnonzero(self._whole(stamps_ns) & (self._of(stamps_ns) == _place(split)))

    def guarded(self, stamps_ns: Stamps) -> int:
        """How many rows are in no split."""
        return int(np.count_nonzero(~self._whole(stamps_ns)))

    def spans_ns(self, split: Split) -> list[tuple[int, int]]:
        """From when to when a split's blocks last; those that follow one another are one."""
        spans: list[tuple[int, int]] = []
        for number in self.number[self.split == _place(split)].tolist():
            start, stop = number * self.block_ns, (number + 1) * self.block_ns
            if spans and spans[-1][1] == start:
                start, _ = spans.pop()
            spans.append((start, stop))
        return spans

    def _of(self, stamps_ns: Stamps) -> NDArray[np.int64]:
        return self.split[self._block(stamps_ns)]

    def _block(self, stamps_ns: Stamps) -> NDArray[np.intp]:
        return np.searchsorted(self.number, stamps_ns // self.block_ns)

    def _whole(self, stamps_ns: Stamps) -> Mask:
        """Whether nothing that a row looks at lies in a block of another split."""
        # A run is what lies between the blocks of other splits; blocks without rows are anybody's.
        change = np.flatnonzero(np.diff(self.split)) + 1
        begins = np.concatenate([[-_FAR], (self.number[change - 1] + 1) * self.block_ns])
        ends = np.concatenate([self.number[change] * self.block_ns, [_FAR]])
        run = np.searchsorted(change, self._block(stamps_ns), side="right")
        whole: Mask = stamps_ns - self.before_ns >= begins[run]
        return whole & (stamps_ns + self.after_ns < ends[run])


def plan_blocks(
    anchors_ns: Sequence[Stamps], name: str, time_split: TimeSplit, manifest: DatasetManifest
) -> TimeBlocks:
    """Draw the split of each block of a drive, so that each split has its share of them.

    The draw follows from the drive's name and the manifest's seed alone.

    Args:
        anchors_ns: The anchors of each recording of the drive, on one clock.
        name: Of the drive: of its group, or its identity.
        time_split: How long blocks are.
        manifest: What a row looks at, the shares and the seed.

    Raises:
        StageError: The drive has fewer blocks than there are splits with a share.
    """
    block_ns = round(time_split.block_s * 1e9)
    number = np.unique(np.concatenate([anchors // block_ns for anchors in anchors_ns]))
    wanted = [split for split in SPLITS if getattr(manifest.split, split) > 0]
    if len(number) < len(wanted):
        raise StageError(
            f"has rows in {len(number)} blocks of {time_split.block_s:g} s, and {len(wanted)} "
            f"splits have a share ({', '.join(wanted)}). Make split.by_time.block_s shorter, or "
            f"declare a group with a split for it."
        )
    half = time_split.guard_s / 2
    return TimeBlocks(
        block_ns,
        round((manifest.looks_back_s + half) * 1e9),
        round((manifest.looks_ahead_s + half) * 1e9),
        number,
        _drawn(_counts(len(number), manifest.split), name, manifest.seed),
    )


def _place(split: Split) -> int:
    return SPLITS.index(split)


def _counts(blocks: int, settings: SplitSettings) -> list[int]:
    """Blocks of each split: the shares of them, by largest remainder, none with a share empty."""
    shares = [float(getattr(settings, split)) for split in SPLITS]
    counts = [max(int(share * blocks), 1 if share > 0 else 0) for share in shares]
    while sum(counts) > blocks:
        spare = [k for k in range(len(SPLITS)) if counts[k] > 1]
        counts[max(spare, key=lambda k: counts[k] - shares[k] * blocks)] -= 1
    while sum(counts) < blocks:
        least = max(range(len(SPLITS)), key=lambda k: shares[k] * blocks - counts[k])
        counts[least] += 1
    return counts


def _drawn(counts: Sequence[int], name: str, seed: int) -> NDArray[np.int64]:
    word = int.from_bytes(hashlib.sha256(f"{seed}/blocks/{name}".encode()).digest()[:16], "big")
    in_order = np.repeat(np.arange(len(counts)), counts)
    return np.random.Generator(np.random.Philox(key=word)).permutation(in_order)
