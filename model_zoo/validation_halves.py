"""The two halves of the validation rows: one selects, one calibrates.

What was chosen on rows looks better on them than it is. So the epoch and the settings are chosen on
one half, and the temperature is fitted on the other.
"""

from __future__ import annotations

import hashlib
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from graspe_data.arrays import Indices, Mask, Stamps
from graspe_data.shards.dataset_index import RecordingEntry


@dataclass(frozen=True)
class Halves:
    """Which rows select and which calibrate, each bool (N,), and how they were told apart."""

    selects: Mask
    calibrates: Mask
    how: str


def halve_validation(
    entries: Sequence[RecordingEntry],
    split: str,
    recording: Indices,
    stamps_ns: Stamps,
    success: Mask,
    mask: Mask,
    horizon_ns: int,
) -> Halves:
    """Divide the rows of a split by recording.

    Recordings that overlap stay together. Those of a group are put in the order of the SHA-256 of
    their names and go to the halves by turns, so the halves do not depend on bytes that another
    processor would have recorded otherwise. Where that leaves a half without failures or without
    successes, recordings with a failure go by turns, and then the others. A single recording is
    cut in the middle of its time; rows whose horizon crosses the cut are in neither half. Where one
    half alone has failures and successes, that one selects; where none has, all rows do both.

    Args:
        entries: The dataset's recordings.
        split: Of it.
        recording: int64 (N,), place of each row's recording among them.
        stamps_ns: int64 (N,), the anchors.
        success: bool (N, T).
        mask: bool (N, T), whether the step is judged.
        horizon_ns: Length of the horizon.
    """
    units = _units(entries, split)
    groups = [entries[unit[0]].group for unit in units]
    failing = {*recording[(mask & ~success).any(axis=1)].tolist()}
    fails = ["" if failing.isdisjoint(unit) else "fails" for unit in units]
    for strata in (groups, fails):
        selects = np.isin(recording, sorted(_first_half(entries, units, strata)))
        halves = Halves(selects, ~selects, "halves by recording")
        if _both(selects, success, mask) and _both(~selects, success, mask):
            return halves
    if len(units) < 2:  # noqa: PLR2004
        halves = _by_time(stamps_ns, horizon_ns)
    return _with_both_classes(halves, success, mask)


def _first_half(
    entries: Sequence[RecordingEntry], units: Sequence[list[int]], strata: Sequence[str]
) -> set[int]:
    """Places of the recordings of the first half: of each stratum every second unit."""
    members: defaultdict[str, list[list[int]]] = defaultdict(list)
    for unit, stratum in zip(units, strata, strict=True):
        members[stratum].append(unit)
    alone = [found[0] for found in members.values() if len(found) == 1]
    ordered = [found for _, found in sorted(members.items()) if len(found) > 1] + [alone]
    in_turn = [
        unit
        for found in ordered
        for unit in sorted(found, key=lambda unit: _rank(entries[unit[0]].name))
    ]
    return {place for unit in in_turn[::2] for place in unit}


def _units(entries: Sequence[RecordingEntry], split: str) -> list[list[int]]:
    """Recordings that must not be parted, each unit with the first name first."""
    units: list[list[int]] = []
    members = [place for place, entry in enumerate(entries) if entry.split == split and entry.rows]
    for place in sorted(members, key=lambda place: entries[place].name):
        linked = [unit for unit in units if any(_linked(entries[place], entries[o]) for o in unit)]
        units = [unit for unit in units if unit not in linked]
        joined = [other for unit in linked for other in unit] + [place]
        units.append(sorted(joined, key=lambda other: entries[other].name))
    return units


def _linked(one: RecordingEntry, other: RecordingEntry) -> bool:
    """Whether they hold measurements of one drive."""
    pairs = ((one, other), (other, one))
    overlap = any(b.name in _listed(a) for a, b in pairs)
    content = one.details.get("content")
    return overlap or (content is not None and content == other.details.get("content"))


def _listed(entry: RecordingEntry) -> list[object]:
    overlaps = entry.details.get("overlaps")
    return [*overlaps] if isinstance(overlaps, list) else []


def _rank(name: str) -> str:
    return hashlib.sha256(name.encode()).hexdigest()


def _by_time(stamps_ns: Stamps, horizon_ns: int) -> Halves:
    ordered = np.sort(stamps_ns)
    cut = ordered[(ordered.size - 1) // 2] if ordered.size else 0
    return Halves(stamps_ns + horizon_ns <= cut, stamps_ns > cut, "halves of one recording's time")


def _both(rows: Mask, success: Mask, mask: Mask) -> bool:
    """Whether the judged steps of some rows are of both classes."""
    judged = success[rows][mask[rows]]
    return bool(judged.any() and not judged.all())


def _with_both_classes(halves: Halves, success: Mask, mask: Mask) -> Halves:
    if _both(halves.selects, success, mask):
        return halves
    if _both(halves.calibrates, success, mask):
        return Halves(halves.calibrates, halves.selects, halves.how)
    every = np.ones(len(mask), np.bool_)
    return Halves(every, every, "all rows, for no half has failures and successes")
