"""Numbered files of one name: parts of one recording where they go on, else recordings."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from graspe_data.recordings.containers.ends import Ends, read_ends
from graspe_data.recordings.messages import Damage

SECOND = 1_000_000_000
LITTLE_NS = SECOND
"""How far the first message of a part may lie from the last one of the part before; before it no
more than half of the shorter of both parts."""
LONGER_THAN_KNOWN = 1.5
"""How much longer than the longest part a missing one may have been."""
TF_TYPES = {"tf2_msgs/msg/TFMessage", "tf/msg/tfMessage"}
NUMBERED = re.compile(
    r"(?P<name>.*?)(?P<date>_?\d{4}(?:-\d+){5})?_(?P<number>\d+)"
    r"\.(?:(?P<bag>bag)(?:\.active)?|(?P<ros2>db3|mcap)(?:\.zstd)?)"
)
"""``rosbag record --split`` puts the time at which a part begins before its number."""


@dataclass(frozen=True)
class NumberedFile:
    """A file that may be a part: ``family`` is what the names of all parts have in common."""

    file: Path
    family: tuple[str, str]
    date: tuple[int, ...]
    number: int

    @property
    def order(self) -> tuple[tuple[int, ...], int, int, str]:
        """By time where the name has one, then by number; a compressed twin comes second."""
        return self.date, self.number, len(self.file.name), self.file.name


@dataclass(frozen=True)
class Parts:
    """The files of one recording in their order; its name is that of the first."""

    files: tuple[Path, ...]
    losses: tuple[Damage, ...] = ()

    @property
    def head(self) -> Path:
        """The first file."""
        return self.files[0]


def numbered_file(file: Path) -> NumberedFile | None:
    """What a file's name says of its place among parts; None where it has no number."""
    match = NUMBERED.fullmatch(file.name)
    if match is None:
        return None
    family = (match["name"], match["bag"] or match["ros2"])
    date = tuple(int(part) for part in re.findall(r"\d+", match["date"] or ""))
    return NumberedFile(file, family, date, int(match["number"]))


def join_parts(files: Iterable[Path]) -> list[Parts]:
    """Which of the files of one folder are parts of one recording.

    Files of one name are parts where each begins, by bag time, within a second of where the one
    before ended, and no topic changes its type. An empty part goes on. Where a damaged file does
    not say when it ends, numbers that begin at 0 are believed, and that is a loss. So is a part
    that is missing between two, where the time between them is no longer than it can have been.

    Returns:
        The recordings, in the order of their names.
    """
    families: dict[tuple[str, str], list[NumberedFile]] = {}
    joined: list[Parts] = []
    for file in files:
        numbered = numbered_file(file)
        if numbered is None:
            joined.append(Parts((file,)))
        else:
            families.setdefault(numbered.family, []).append(numbered)
    for family in families.values():
        joined += _join_family(sorted(family, key=lambda part: part.order))
    return sorted(joined, key=lambda parts: parts.head)


def parts_of(file: Path) -> Parts:
    """The recording that a file is, or is a part of.

    Raises:
        OSError: Its folder cannot be listed.
    """
    numbered = numbered_file(file)
    if numbered is None:
        return Parts((file,))
    found = [numbered_file(item) for item in file.parent.iterdir() if item.is_file()]
    family = [item for item in found if item is not None and item.family == numbered.family]
    joined = _join_family(sorted(family, key=lambda part: part.order))
    return next((parts for parts in joined if file in parts.files), Parts((file,)))


def _join_family(family: Sequence[NumberedFile]) -> list[Parts]:
    if len(family) == 1:
        return [Parts((family[0].file,))]
    chains: list[_Chain] = []
    for place, part in enumerate(family):
        ends, before = read_ends(part.file), family[place - 1]
        following = [
            chain
            for chain in chains
            if part.number == chain.parts[-1].number + 1 or chain.parts[-1] is before
        ]
        if not any(chain.take(part, ends) for chain in following):
            chains.append(_chain(part, ends))
    return [
        Parts(tuple(part.file for part in chain.parts), tuple(chain.losses)) for chain in chains
    ]


@dataclass
class _Chain:
    """Parts found so far: when they begin and end, and the types of their topics."""

    parts: list[NumberedFile]
    types: dict[str, str]
    start_ns: int | None
    stop_ns: int | None
    empty: bool
    longest_ns: int
    last_ns: int
    losses: list[Damage] = field(default_factory=list)

    def take(self, part: NumberedFile, ends: Ends) -> bool:
        """Append a part where it goes on; False where it does not."""
        missing = part.number - self.parts[-1].number - 1
        alike = all(_alike(self.types.get(topic, kind), kind) for topic, kind in ends.types.items())
        if missing < 0 or not alike:
            return False
        note = self._note(part, ends, missing)
        if note is None:
            return False
        self.losses += [Damage(note)] if note else []
        self.parts.append(part)
        self.types = {**ends.types, **self.types}
        if not ends.empty:
            self.start_ns = ends.start_ns if self.empty else self.start_ns
            self.stop_ns, self.empty = ends.stop_ns, False
            self.last_ns = _length_ns(ends)
            self.longest_ns = max(self.longest_ns, self.last_ns)
        return True

    def _note(self, part: NumberedFile, ends: Ends, missing: int) -> str | None:
        """What is to be said of a part that goes on, nothing perhaps; None where it does not."""
        last, from_zero = self.parts[-1], self.parts[0].number == 0
        if ends.empty or self.empty:
            return None if missing else ""
        if self.stop_ns is None or ends.start_ns is None:
            backwards = (ends.start_ns or 0) < (self.start_ns or 0) and ends.start_ns is not None
            if missing or backwards or not from_zero:
                return None
            unknown = last if self.stop_ns is None else part
            end = "ends" if unknown is last else "begins"
            return (
                f"{unknown.file.name}: damaged, so nothing says when it {end}; by its number alone "
                f"{part.file.name} is taken as the part after {last.file.name}"
            )
        gap, before = ends.start_ns - self.stop_ns, min(self.last_ns, _length_ns(ends)) // 2
        longest = max(self.longest_ns, _length_ns(ends))
        allowed = LITTLE_NS + int(missing * LONGER_THAN_KNOWN * longest)
        if not -min(LITTLE_NS, before) <= gap <= allowed or (missing and not from_zero):
            return None
        if not missing:
            return ""
        return (
            f"{missing} part{'s' * (missing > 1)} missing between {last.file.name} and "
            f"{part.file.name}: {gap / SECOND:.1f} s lie between them"
        )


def _chain(part: NumberedFile, ends: Ends) -> _Chain:
    length = _length_ns(ends)
    times = ends.start_ns, ends.stop_ns
    return _Chain([part], dict(ends.types), *times, ends.empty, length, length)


def _length_ns(ends: Ends) -> int:
    known = ends.start_ns is not None and ends.stop_ns is not None
    return (ends.stop_ns or 0) - (ends.start_ns or 0) if known else 0


def _alike(one: str, other: str) -> bool:
    return one == other or {one, other} <= TF_TYPES
