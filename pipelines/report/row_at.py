"""A row by the name of its recording and a second of it, as a person reads it off a video."""

from __future__ import annotations

import difflib
import math
from collections.abc import Collection
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from graspe_data.errors import ShardError
from graspe_data.shards.dataset_index import DatasetIndex, RecordingEntry, read_index
from pipelines.report.row_blocks import row_blocks

BESIDE_S = 1.0
"""So far before the first row of a recording, or behind its last, a second still means that row."""
SHOWN = 10


@dataclass(frozen=True)
class RowAt:
    """The row nearest to a moment.

    Attributes:
        split: Where it is.
        row: Its index there.
        recording: Name of its recording.
        time_s: Its own second, from the recording's time zero.
        apart_s: How far that is from the second asked for, at least 0.
    """

    split: str
    row: int
    recording: str
    time_s: float
    apart_s: float


def find_row(folder: Path, name: str, second: float, split: str | None = None) -> RowAt:
    """The row of a recording that is nearest to a second of it; of two as near the earlier one.

    Args:
        folder: The dataset's folder.
        name: Of the recording, as ``graspe dataset info`` lists it; where several have it, the
            beginning of a digest.
        second: From the recording's time zero, from which its labels file counts.
        split: Where to look; None for all.

    Raises:
        ShardError: No such recording or split, no row of it there, or the second lies more than a
            second outside of its rows; the text lists what there is.
    """
    if not math.isfinite(second):
        raise ShardError(f"{folder}: --at {name} {second}: expected a number of seconds.")
    index = read_index(folder)
    numbers = _recording(folder, index, name)
    entry, splits = index.recordings[numbers[0]], [split] if split else sorted(index.splits)
    # 1. The stamps of its rows, and where each row is.
    places, stamps = _rows(folder, numbers, splits)
    if not places:
        raise ShardError(
            f"{folder}: {entry.name} has no rows in {', '.join(splits)}"
            f"{_why(entry, split)}. `graspe dataset info` lists the rows of each recording."
        )
    # 2. Their time since the recording's start, ns, and the nearest; of two as near the earlier.
    since = stamps - _time_zero(folder, entry)
    first, last = since.min() / 1e9, since.max() / 1e9
    if not first - BESIDE_S <= second <= last + BESIDE_S:
        raise ShardError(
            f"{folder}: {entry.name} has no row at {second:g} s: its {len(places)} rows in "
            f"{', '.join(splits)} lie between {first:.1f} and {last:.1f} s since its start."
        )
    apart = np.abs(since - round(second * 1e9))
    nearest = int(np.lexsort((since, apart))[0])
    where, row = places[nearest]
    return RowAt(where, row, entry.name, int(since[nearest]) / 1e9, int(apart[nearest]) / 1e9)


def _recording(folder: Path, index: DatasetIndex, name: str) -> list[int]:
    """The places of a recording in the index, by its name or the beginning of its digest.

    They are several where blocks of time of it went to different splits.
    """
    entries = list(enumerate(index.recordings))
    found = [number for number, entry in entries if entry.name == name]
    found = found or [n for n, e in entries if name and e.digest.startswith(name)]
    different = list(dict.fromkeys(index.recordings[number].digest for number in found))
    if len(different) > 1:
        digests = ", ".join(digest[:12] for digest in different)
        raise ShardError(
            f"{folder}: {len(different)} recordings are called {name}. Give the beginning of a "
            f"digest in place of the name: {digests}."
        )
    if not found:
        names = [entry.name for _, entry in entries]
        raise ShardError(f"{folder}: no recording {name!r}. {_known(name, names)}")
    return found


def _known(name: str, names: Collection[str]) -> str:
    listed = sorted(set(names))
    near = difflib.get_close_matches(name, listed, n=1, cutoff=0.5)
    more = f" and {len(listed) - SHOWN} more" if len(listed) > SHOWN else ""
    meant = f"Did you mean {near[0]!r}? " if near else ""
    return f"{meant}It has {', '.join(listed[:SHOWN]) or 'none'}{more}."


def _rows(
    folder: Path, numbers: Collection[int], splits: Collection[str]
) -> tuple[list[tuple[str, int]], NDArray[np.int64]]:
    places: list[tuple[str, int]] = []
    stamps: list[int] = []
    for split in splits:
        for block in row_blocks(folder, split, ("recording", "stamp_ns")):
            own = np.flatnonzero(np.isin(block.columns["recording"], list(numbers)))
            places += [(split, block.start + row) for row in own.tolist()]
            stamps += block.columns["stamp_ns"][own].tolist()
    return places, np.array(stamps, np.int64)


def _why(entry: RecordingEntry, split: str | None) -> str:
    if "refused" in entry.details:
        return f"; it was refused: {entry.details['refused']}"
    return "; they may be in another split" if split and entry.rows else ""


def _time_zero(folder: Path, entry: RecordingEntry) -> int:
    zero = entry.details.get("time_zero_ns")
    if not isinstance(zero, int):
        raise ShardError(
            f"{folder}: does not keep when {entry.name} begins, since it was built by an earlier "
            "version. Build it again, or give the row's number."
        )
    return zero
