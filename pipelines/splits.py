"""Which split a group of recordings goes to."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass, field

from pipelines.dataset_settings import Split, SplitSettings
from pipelines.same_drives import DriveIdentity, find_links

DIGEST_RANGE = 2.0**64


@dataclass(frozen=True)
class SplitPlacement:
    """The group and the split of a recording, and what else of its drive there is."""

    group: str
    split: Split
    linked: tuple[str, ...] = ()
    """Names of the recordings that overlap it or are parts of its run."""
    declared: bool = False
    """Whether a group declares the split; else it was drawn."""
    drive: str = ""
    """What names the drive, all of its recordings alike."""


def split_of(
    recording: str, identity: str, settings: SplitSettings, seed: int
) -> tuple[str, Split]:
    """The group of a recording that overlaps no other, and the split of that group.

    A recording in no declared group is its own, named by its identity, which is that of its content
    where it has one. A group without a declared split draws one from its name and the seed: the
    draw does not depend on which other recordings there are, nor on what they are called, so adding
    or renaming one moves none.
    """
    group = settings.group_of(recording)
    name = group.name if group else identity[:12]
    if group is not None and group.split is not None:
        return name, group.split
    return name, _draw_split(name, settings, seed)


def place_recordings(
    drives: Sequence[DriveIdentity], settings: SplitSettings, seed: int
) -> list[SplitPlacement | str]:
    """The place of each recording, in the order given; the reason in words where it has none.

    Recordings of one drive are in one group, hence in one split. A declared group takes with it
    what its recordings overlap. Where no group is declared, the group is named by the smallest
    identity in it. Of recordings that overlap and that declared groups put in different splits, the
    one whose name comes later is refused.
    """
    links = find_links(drives)
    near: dict[int, dict[int, str]] = {number: {} for number in range(len(drives))}
    for link in links:
        near[link.one][link.other] = near[link.other][link.one] = link.reason
    groups = _Groups(settings)
    order = sorted(
        near,
        key=lambda n: (settings.group_of(drives[n].name) is None, drives[n].name, drives[n].digest),
    )
    taken: set[int] = set()
    refused: dict[int, str] = {}
    for number in order:
        known = {n: near[number][n] for n in sorted(near[number].keys() & taken, key=order.index)}
        if reason := groups.add(drives, number, known):
            refused[number] = reason
        else:
            taken.add(number)
    return [
        refused.get(number)
        or groups.placement(drives[number], _names(drives, taken & near[number].keys()), seed)
        for number in range(len(drives))
    ]


def _names(drives: Sequence[DriveIdentity], numbers: set[int]) -> tuple[str, ...]:
    return tuple(sorted(drives[number].name for number in numbers))


def _draw_split(name: str, settings: SplitSettings, seed: int) -> Split:
    digest = hashlib.sha256(f"{seed}/{name}".encode()).digest()
    draw = int.from_bytes(digest[:8], "big") / DIGEST_RANGE
    if draw < settings.train:
        return "train"
    return "validation" if draw < settings.train + settings.validation else "test"


@dataclass
class _Union:
    """Recordings and declared groups that must be in one split."""

    declared: set[str] = field(default_factory=set)
    identities: set[str] = field(default_factory=set)
    split: Split | None = None

    @property
    def name(self) -> str:
        return min(self.declared) if self.declared else min(self.identities)[:12]


class _Groups:
    """Grows unions, recording by recording."""

    def __init__(self, settings: SplitSettings) -> None:
        self._settings = settings
        self._of_recording: dict[str, _Union] = {}
        self._of_group = {
            group.name: _Union(declared={group.name}, split=group.split)
            for group in settings.groups
        }

    def add(self, drives: Sequence[DriveIdentity], number: int, near: dict[int, str]) -> str | None:
        """Add a recording and what it is linked to; or say why its groups cannot be one."""
        drive = drives[number]
        group = self._settings.group_of(drive.name)
        own = self._of_group[group.name] if group else _Union()
        unions = {id(own): own}
        for other, reason in near.items():
            union = self._of_recording[drives[other].digest]
            if fault := self._conflict(drive, drives[other], [*unions.values()], union, reason):
                return fault
            unions[id(union)] = union
        merged = _Union(
            set[str]().union(*(union.declared for union in unions.values())),
            {drive.identity}.union(*(union.identities for union in unions.values())),
            next((union.split for union in unions.values() if union.split), None),
        )
        for known in (self._of_recording, self._of_group):
            known.update({name: merged for name, union in known.items() if id(union) in unions})
        self._of_recording[drive.digest] = merged
        return None

    def placement(self, drive: DriveIdentity, linked: tuple[str, ...], seed: int) -> SplitPlacement:
        union, group = self._of_recording[drive.digest], self._settings.group_of(drive.name)
        split = union.split or _draw_split(union.name, self._settings, seed)
        named = group.name if group else union.name
        return SplitPlacement(named, split, linked, union.split is not None, union.name)

    def _conflict(
        self,
        drive: DriveIdentity,
        other: DriveIdentity,
        so_far: Sequence[_Union],
        union: _Union,
        reason: str,
    ) -> str | None:
        before = next((known for known in so_far if known.split), None)
        if before is None or union.split in (None, before.split):
            return None
        return (
            f"{drive.name}: {reason} {other.name}, but the declared groups {before.name} "
            f"({before.split}) and {union.name} ({union.split}) put them in different splits. List "
            f"both recordings in one group under split.groups, or leave one of them out."
        )
