"""What the report says first: what a reader of a dataset should not miss."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from graspe_data.shards.dataset_index import DatasetIndex
from pipelines.report.balance import SplitBalance
from pipelines.report.row_blocks import row_blocks

EMPTY_SHARE = 0.25
"""The share of a split's trajectory images from which on their being empty is told."""
STANDING_M_S = 0.1
IMAGES_A_BLOCK = 1024


def notices(folder: Path, index: DatasetIndex, balances: Mapping[str, SplitBalance]) -> list[str]:
    """Tell of empty splits and trajectory images, of absent failures, refusals and damage.

    Raises:
        ShardError: A shard is missing or damaged.
    """
    lines = [f"The split {s} has no rows." for s, b in balances.items() if not b.whole.rows]
    if not any(balance.whole.rows_failing for balance in balances.values()):
        lines.append("No row fails: a model cannot learn failure from this dataset alone.")
    refused = sum(
        "refused" in entry.details and "counted_as" not in entry.details
        for entry in index.recordings
    )
    damaged = sum(bool(entry.details.get("damage")) for entry in index.recordings)
    if refused:
        lines.append(f"{refused} of {len(index.recordings)} recordings were refused.")
    mended = sum(
        any(course in ("mended", "noted") for course, _ in entry.findings)
        for entry in index.recordings
    )
    if mended:
        lines.append(
            f"In {mended} of {len(index.recordings)} recordings sources disagree: what was done "
            f"stands below, under Recordings."
        )
    if damaged:
        lines.append(f"{damaged} of {len(index.recordings)} recordings are damaged in part.")
    lines += _same_drives(index)
    filled = {split: b.whole.rows for split, b in balances.items() if b.whole.rows}
    lines += [_empty_images(folder, split, rows) for split, rows in filled.items()]
    return [notice for notice in lines if notice]


def _same_drives(index: DatasetIndex) -> list[str]:
    """Recordings that count once, and those that overlap, by name."""
    lines = [
        f"{entry.name} is the same drive as {entry.details['counted_as']}; it counts once."
        for entry in index.recordings
        if "counted_as" in entry.details
    ]
    for entry in index.recordings:
        overlaps = entry.details.get("overlaps")
        others = [str(name) for name in overlaps] if isinstance(overlaps, list) else []
        if others:
            lines.append(
                f"{entry.name} is of one drive with {', '.join(others)}; they are in one split."
            )
    return lines


def _empty_images(folder: Path, split: str, rows: int) -> str:
    """How many trajectory images of a split are empty, and why; nothing where they are few."""
    empty, standing = _count_empty(folder, split)
    if empty < EMPTY_SHARE * rows:
        return ""
    text = f"The trajectory image is empty in {empty:,} of {rows:,} rows of {split}"
    stands = f"in {standing:,} of them the robot stands"
    if empty - standing < EMPTY_SHARE * rows:
        return f"{text}; {stands}."
    return (
        f"{text}: {f'{stands}; in the others ' if standing else ''}the arc ends before the "
        "picture's ground begins, or runs beside it. Lengthen the horizon, drive faster, or draw "
        "it as from behind the camera: `trajectory_image: {behind: 1.0}` in the dataset's manifest."
    )


def _count_empty(folder: Path, split: str) -> tuple[int, int]:
    """Rows whose trajectory image is empty, and those of them in which the robot stands."""
    empty = standing = 0
    columns = ("trajectory_image", "velocity_history")
    for block in row_blocks(folder, split, columns, IMAGES_A_BLOCK, decode=False):
        blank = ~block.columns["trajectory_image"].any(axis=(1, 2))
        speed = np.abs(block.columns["velocity_history"][:, -1, 0])
        empty += int(np.count_nonzero(blank))
        standing += int(np.count_nonzero(blank & (speed < STANDING_M_S)))
    return empty, standing
