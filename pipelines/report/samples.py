"""Which rows the report shows."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator
from dataclasses import dataclass, replace
from heapq import nsmallest
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from graspe_data.shards.dataset import Dataset
from pipelines.report.row_blocks import row_blocks

COLUMNS = ("success", "success_mask", "r_img", "r_point", "image_valid", "points_valid")
LEAST = 2
MOVING_M_S = 0.2
BEHIND = 1e12


@dataclass(frozen=True, order=True)
class Candidate:
    """A row that a group may show; the lower its rank, the rather."""

    rank: float
    split: str
    row: int


@dataclass(frozen=True)
class SampleGroup:
    """Rows shown for one reason."""

    title: str
    rows: tuple[Candidate, ...]


def choose_samples(folder: Path, splits: Collection[str], each: int = 4) -> list[SampleGroup]:
    """Choose rows that fail, rows that succeed, and the least reliable pictures and clouds.

    Rows lie shuffled in their splits, so the first are as good as drawn by lot; of those that
    succeed, rows in which the robot moves come first. No row is shown twice.

    Raises:
        ShardError: A shard is missing or damaged.
    """
    found: dict[str, list[Candidate]] = {title: [] for title in _GROUPS}
    for title, candidate in _candidates(folder, splits, 8 * each):
        found[title].append(candidate)
    taken: set[tuple[str, int]] = set()
    groups = []
    for title, size in _GROUPS.items():
        fresh = [c for c in found[title] if (c.split, c.row) not in taken]
        if title == _SUCCEEDING:
            fresh = _moving_first(folder, nsmallest(8 * each, fresh))
        rows = tuple(nsmallest(min(size, each), fresh))
        taken |= {(candidate.split, candidate.row) for candidate in rows}
        groups.append(SampleGroup(title, rows))
    return groups


_FAILING = "Rows that fail"
_SUCCEEDING = "Rows that succeed"
_LEAST_IMAGE = "The least reliable pictures"
_LEAST_POINTS = "The least reliable clouds"
_GROUPS = {_FAILING: 4, _SUCCEEDING: 4, _LEAST_IMAGE: LEAST, _LEAST_POINTS: LEAST}


def _candidates(
    folder: Path, splits: Collection[str], most: int
) -> Iterator[tuple[str, Candidate]]:
    """The best rows of every block, for every group."""
    for split in splits:
        for block in row_blocks(folder, split, COLUMNS):
            for title, ranks in _ranks(block.columns).items():
                best = np.argsort(ranks, kind="stable")[:most]
                for row in best[np.isfinite(ranks[best])].tolist():
                    rank = float(ranks[row])
                    yield title, Candidate(rank, split, block.start + row)


def _ranks(row: dict[str, NDArray[Any]]) -> dict[str, NDArray[np.float64]]:
    """The rank of each row in each group, inf where it does not belong."""
    judged = row["success_mask"]
    failing = (judged & (row["success"] == 0)).any(axis=1)
    succeeding = judged.any(axis=1) & ~failing
    order = np.arange(len(failing), dtype=np.float64)
    return {
        _FAILING: np.where(failing, order, np.inf),
        _SUCCEEDING: np.where(succeeding, order, np.inf),
        _LEAST_IMAGE: np.where(row["image_valid"], row["r_img"], np.inf).astype(np.float64),
        _LEAST_POINTS: np.where(row["points_valid"], row["r_point"], np.inf).astype(np.float64),
    }


def _moving_first(folder: Path, candidates: Iterable[Candidate]) -> list[Candidate]:
    """The candidates, those in which the robot stands ranked behind the others."""
    ranked = []
    for candidate in candidates:
        history = Dataset(folder, candidate.split, ["velocity_history"]).row(candidate.row)
        speed = abs(float(history["velocity_history"][-1, 0]))
        ranked.append(replace(candidate, rank=candidate.rank + BEHIND * (speed < MOVING_M_S)))
    return ranked
