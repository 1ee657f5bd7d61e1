"""Whether what is examined was ever taught: by recording, by content, by overlap, and by world."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Final

from graspe_data.errors import ZooError
from graspe_data.shards.dataset_index import RecordingEntry

BEFORE: Final = {"train": (), "validation": ("train",)}
"""The splits that come before one; before any other come both."""
_BOTH: Final = ("train", "validation")


def check_apart(
    teaching: Sequence[RecordingEntry],
    examined: Sequence[RecordingEntry],
    split: str,
    where: Path,
) -> None:
    """Refuse a split of which something stands in the splits before it.

    Two recordings are not apart if they have the same bytes, say the same, hold measurements of one
    drive, or were simulated in one world: a scenario and a seed, which have one layout.

    Args:
        teaching: Recordings of the dataset whose training and validation rows teach and choose.
        examined: Recordings of the dataset of the split; the same, or another.
        split: What is examined.
        where: The dataset that teaches, for the error's text.

    Raises:
        ZooError: Names both recordings, and what they share.
    """
    for earlier in BEFORE.get(split, _BOTH):
        marks: dict[tuple[str, str], list[RecordingEntry]] = {}
        for entry in teaching:
            if entry.split == earlier and entry.rows:
                for mark in _marks(entry):
                    marks.setdefault(mark, []).append(entry)
        for entry in examined:
            if entry.split != split or not entry.rows:
                continue
            shared, other = next(_shared(entry, marks), (None, entry))
            if shared is not None:
                raise ZooError(
                    f"{where}: {entry.name} of the split {split!r} and {other.name} of the "
                    f"split {earlier!r} have the same {shared[0]}, so a score on it is no score on "
                    f"unseen data. List both in one group under split.groups, and build again."
                )


def _shared(
    entry: RecordingEntry, marks: Mapping[tuple[str, str], Sequence[RecordingEntry]]
) -> Iterator[tuple[tuple[str, str], RecordingEntry]]:
    """What an examined recording shares with those that teach, other blocks of its time apart."""
    for mark in _marks(entry):
        for other in marks.get(mark, ()):
            if not entry.is_apart_from(other):
                yield mark, other


def _marks(entry: RecordingEntry) -> Iterator[tuple[str, str]]:
    if entry.digest:
        yield "bytes", entry.digest
    content = entry.details.get("content")
    if isinstance(content, str) and content:
        yield "content", content
    world = entry.details.get("world")
    if isinstance(world, str) and world:
        yield "world", world
    overlaps = entry.details.get("overlaps")
    for name in overlaps if isinstance(overlaps, list) else ():
        yield "drive", " and ".join(sorted((entry.name, str(name))))
