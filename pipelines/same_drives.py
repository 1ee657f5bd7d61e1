"""Which recordings are of one drive: the same, overlapping, or parts of one run."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from graspe_data.recordings.identity import ContentIdentity
from graspe_data.recordings.parts import LITTLE_NS, NumberedFile, numbered_file


@dataclass(frozen=True)
class DriveIdentity:
    """A recording as the split sees it: its name, its files' names and its two identities."""

    name: str
    digest: str
    content: ContentIdentity = field(default_factory=ContentIdentity)
    files: tuple[str, ...] = ()

    @property
    def identity(self) -> str:
        """The digest of the content, the same in any container; of the bytes where it has none."""
        return self.content.digest or self.digest


@dataclass(frozen=True)
class Link:
    """Two recordings, by their place in the list, and what joins them."""

    one: int
    other: int
    reason: str


OVERLAP = "holds the same measurements as"
ONE_RUN = "is a part of one run with"


def find_links(drives: Sequence[DriveIdentity]) -> list[Link]:
    """The pairs of recordings that must not be on two sides of a split."""
    overlapping = _overlapping(drives)
    links = [Link(one, other, OVERLAP) for one, other in overlapping]
    links += [Link(*pair, ONE_RUN) for pair in _runs(drives) if pair not in overlapping]
    return links


def _overlapping(drives: Sequence[DriveIdentity]) -> list[tuple[int, int]]:
    pairs = {*_sharing(drives, "image"), *_sharing(drives, "points")}
    return sorted(
        (one, other) for one, other in pairs if drives[one].content.overlaps(drives[other].content)
    )


def _sharing(drives: Sequence[DriveIdentity], kind: str) -> Iterator[tuple[int, int]]:
    """The pairs that have a fingerprint in common, found by sorting all of them once."""
    found = [np.array(drive.content.fingerprints.get(kind, ()), np.uint64) for drive in drives]
    owners = np.repeat(np.arange(len(drives)), [len(one) for one in found])
    prints = np.concatenate(found) if found else np.empty(0, np.uint64)
    order = np.lexsort((owners, prints))
    prints, owners = prints[order], owners[order]
    for start, stop in _runs_of_equals(prints):
        several = owners[start:stop].tolist()
        yield from ((one, other) for n, one in enumerate(several) for other in several[n + 1 :])


def _runs_of_equals(values: NDArray[np.uint64]) -> Iterator[tuple[int, int]]:
    edges = np.flatnonzero(np.diff(values)) + 1
    starts, stops = np.concatenate([[0], edges]), np.concatenate([edges, [values.size]])
    for start, stop in zip(starts.tolist(), stops.tolist(), strict=True):
        if stop - start > 1:
            yield start, stop


def _runs(drives: Sequence[DriveIdentity]) -> Iterator[tuple[int, int]]:
    """Pairs of numbered recordings of one name between which a part is missing or nothing is."""
    families: dict[tuple[str, str], list[tuple[NumberedFile, NumberedFile, int]]] = {}
    for place, drive in enumerate(drives):
        names = drive.files or (drive.name,)
        first, last = numbered_file(Path(names[0])), numbered_file(Path(names[-1]))
        if first is not None and last is not None:
            families.setdefault(first.family, []).append((first, last, place))
    for family in families.values():
        family.sort(key=lambda item: (*item[0].order, item[2]))
        for before, after in pairwise(family):
            missing = after[0].number - before[1].number - 1
            gap = drives[after[2]].content.begin_ns - drives[before[2]].content.end_ns
            goes_on = missing == 0 and abs(gap) <= LITTLE_NS
            if goes_on or (missing > 0 and family[0][0].number == 0 and gap >= -LITTLE_NS):
                yield min(before[2], after[2]), max(before[2], after[2])
