"""Which rows the report shows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipelines.report.row_blocks import Block, row_blocks

COLUMNS = (
    "success",
    "success_mask",
    "r_img",
    "r_point",
    "image_valid",
    "points_valid",
    "velocity_history",
    "stamp_ns",
    "recording",
)
MOVING_M_S = 0.2
APART_NS = (3_000_000_000, 1_000_000_000, 300_000_000)
"""Rows of a recording that are less apart show more and more the same."""
LAST_RESORT = 1e6
MOST_A_RECORDING = 64

Table = NDArray[np.void]

_ENTRY = np.dtype([("rank", "f8"), ("recording", "i8"), ("stamp_ns", "i8"), ("row", "i8")])


@dataclass(frozen=True)
class Candidate:
    """A row that a group may show; the lower its rank, the rather."""

    rank: float
    split: str
    row: int
    recording: int
    stamp_ns: int

    def nearness(self, other: Candidate) -> int:
        """How much of the same scene it shows as another row: 0 to 3."""
        if self.recording != other.recording:
            return 0
        return sum(abs(self.stamp_ns - other.stamp_ns) < apart for apart in APART_NS)


@dataclass(frozen=True)
class SampleGroup:
    """Rows shown for one reason."""

    title: str
    rows: tuple[Candidate, ...]


def choose_samples(folder: Path, splits: Sequence[str], each: int = 4) -> list[SampleGroup]:
    """Choose rows that fail, rows that succeed, and the least reliable pictures and clouds.

    Rows that fail and rows that succeed are of every recording in turn, those of the first split
    first. Of those that fail, rows whose failure begins near the middle of the horizon come first
    and such as fail at once last; of those that succeed, rows in which the robot moves come first.
    Rows of a group are some seconds apart where that can be. No row is shown twice.

    Args:
        folder: The dataset's folder.
        splits: The splits to choose from, the most interesting first.
        each: The most rows of a group.

    Raises:
        ShardError: A shard is missing or damaged.
    """
    found: dict[str, list[Candidate]] = {title: [] for title in _GROUPS}
    for split in splits:
        for title, table in _tables(folder, split).items():
            found[title] += [
                Candidate(rank, split, row, recording, stamp_ns)
                for rank, recording, stamp_ns, row in table.tolist()
            ]
    shown: set[tuple[str, int]] = set()
    groups = []
    for title, size in _GROUPS.items():
        fresh = [c for c in found[title] if (c.split, c.row) not in shown]
        in_turn = splits if title in (_FAILING, _SUCCEEDING) else None
        rows = _spread(fresh, min(size, each), in_turn)
        shown |= {(candidate.split, candidate.row) for candidate in rows}
        groups.append(SampleGroup(title, tuple(rows)))
    return groups


_FAILING = "Rows that fail"
_SUCCEEDING = "Rows that succeed"
_LEAST_IMAGE = "The least reliable pictures"
_LEAST_POINTS = "The least reliable clouds"
_GROUPS = {_FAILING: 4, _SUCCEEDING: 4, _LEAST_IMAGE: 2, _LEAST_POINTS: 2}


def _tables(folder: Path, split: str) -> dict[str, Table]:
    """The best rows of every recording, for every group."""
    tables = dict.fromkeys(_GROUPS, np.empty(0, _ENTRY))
    for block in row_blocks(folder, split, COLUMNS):
        for title, ranks in _ranks(block.columns).items():
            tables[title] = _best(np.concatenate((tables[title], _table(block, ranks))))
    return tables


def _ranks(row: dict[str, NDArray[Any]]) -> dict[str, NDArray[np.float64]]:
    """The rank of each row in each group, inf where it does not belong."""
    judged = row["success_mask"]
    failing = judged & (row["success"] == 0)
    fails = failing.any(axis=1)
    begins = failing.argmax(axis=1)
    begun = np.where(begins > 0, np.abs(begins - judged.shape[1] // 2), LAST_RESORT)
    standing = np.abs(row["velocity_history"][:, -1, 0]) < MOVING_M_S
    return {
        _FAILING: np.where(fails, begun, np.inf),
        _SUCCEEDING: np.where(judged.any(axis=1) & ~fails, LAST_RESORT * standing, np.inf),
        _LEAST_IMAGE: np.where(row["image_valid"], row["r_img"], np.inf).astype(np.float64),
        _LEAST_POINTS: np.where(row["points_valid"], row["r_point"], np.inf).astype(np.float64),
    }


def _table(block: Block, ranks: NDArray[np.float64]) -> Table:
    rows = np.flatnonzero(np.isfinite(ranks))
    table = np.empty(rows.size, _ENTRY)
    table["rank"], table["row"] = ranks[rows], rows + block.start
    for name in ("recording", "stamp_ns"):
        table[name] = block.columns[name][rows]
    return table


def _best(table: Table) -> Table:
    """The first few of each recording by rank; of equals the first, which is one by lot."""
    table = table[np.lexsort((table["row"], table["rank"], table["recording"]))]
    first = np.searchsorted(table["recording"], table["recording"])
    return table[np.arange(table.size) - first < MOST_A_RECORDING]


def _spread(
    candidates: Sequence[Candidate], count: int, in_turn: Sequence[str] | None
) -> list[Candidate]:
    """The best by rank and apart in time; with ``in_turn`` of each recording, split by split."""
    chosen: list[Candidate] = []

    def order(candidate: Candidate) -> tuple[float, ...]:
        near = max((candidate.nearness(other) for other in chosen), default=0)
        order = (candidate.rank >= LAST_RESORT, near, candidate.rank, candidate.row)
        if in_turn is None:
            return order
        turns = sum(candidate.recording == other.recording for other in chosen)
        return (turns, in_turn.index(candidate.split), *order)

    left = list(candidates)
    while left and len(chosen) < count:
        best = min(left, key=order)
        chosen.append(best)
        left.remove(best)
    if in_turn is not None:
        chosen.sort(key=lambda c: (in_turn.index(c.split), c.recording, c.stamp_ns))
    return chosen
