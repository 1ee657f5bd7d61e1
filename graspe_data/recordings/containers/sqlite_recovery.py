"""A private copy of an SQLite file with what its write-ahead log or journal says.

Nothing beside the user's file is written, and SQLite itself never sees the log: a journal may
name other files, which it would open and delete.
"""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path

from graspe_data.errors import RecordingError
from graspe_data.recordings.containers.sqlite_log import (
    LOG_HEADER,
    LogEnd,
    Page,
    committed_end,
    indexed_frames,
    journal_pages,
    log_pages,
)
from graspe_data.recordings.messages import Damage

LOG, INDEX, JOURNAL = "-wal", "-shm", "-journal"
SMALLEST_ROW = 6
PIECE = 1 << 20


@dataclass
class RecoveredCopy:
    """The copy, and what the log held beyond its last commit."""

    folder: Path
    path: Path
    losses: list[Damage] = field(default_factory=list)
    tail: str = ""
    tail_bytes: int = 0
    tail_rows: list[int] = field(default_factory=list)

    def lost_rows(self, newest: int) -> int | None:
        """How many rows the tail numbers after the newest one; None where it numbers none."""
        limit = newest + self.tail_bytes // SMALLEST_ROW
        beyond = [number for number in self.tail_rows if newest < number <= limit]
        return max(beyond) - newest if beyond else None

    def remove(self) -> None:
        """Remove the copy."""
        shutil.rmtree(self.folder, ignore_errors=True)


def log_beside(path: Path) -> Path | None:
    """The write-ahead log or journal of a database, if there is one that holds anything."""
    for name in (path, path.resolve()):
        for suffix in (LOG, JOURNAL):
            beside = name.with_name(name.name + suffix)
            if beside.is_file() and beside.stat().st_size > LOG_HEADER.size:
                return beside
    return None


def orphaned_log(path: Path) -> str:
    """What to say of a log or journal without its database; empty where there is none.

    Args:
        path: The log itself, or a folder without a recording.
    """
    files = sorted(path.iterdir()) if path.is_dir() else [path]
    for file in files:
        for suffix in (LOG, JOURNAL):
            database = file.name.removesuffix(suffix)
            if file.name.endswith(f".db3{suffix}") and not file.with_name(database).exists():
                return (
                    f" {file.name} belongs to the database {database}, which is missing here; "
                    f"copy it from the robot too."
                )
    return ""


def recover(path: Path) -> RecoveredCopy | None:
    """Copy a database and bring the copy to its last commit; None where nothing lies beside it.

    Raises:
        RecordingError: There is no space, a file cannot be read, or it is being written to.
    """
    try:
        beside = log_beside(path)
        if beside is None:
            return None
        before = [_state(path), _state(beside)]
        _check_space(path)
        folder = Path(tempfile.mkdtemp(prefix="graspe-"))
        copy = RecoveredCopy(folder, folder / path.name)
        try:
            _copy(path, copy.path)
            if beside.name.endswith(LOG):
                _apply_log(beside, copy)
            else:
                _roll_back(beside, copy)
            _check_still(path, [_state(path), _state(beside)] == before)
        except BaseException:
            copy.remove()
            raise
    except OSError as error:
        raise RecordingError(f"{path}: cannot be copied with its log: {error}.") from error
    return copy


def _state(path: Path) -> tuple[int, int]:
    state = path.stat()
    return state.st_size, state.st_mtime_ns


def _check_still(path: Path, still: bool) -> None:
    if not still:
        raise RecordingError(
            f"{path}: is being written to while it is read. Stop the recorder first."
        )


def _check_space(path: Path) -> None:
    needed, folder = path.stat().st_size, tempfile.gettempdir()
    free = shutil.disk_usage(folder).free
    if needed > free:
        raise RecordingError(
            f"{path}: has a write-ahead log or journal beside it and is read from a copy of "
            f"{needed} bytes, but {folder} has {free} free. Set TMPDIR to a larger disk."
        )


def _copy(path: Path, target: Path) -> None:
    left = path.stat().st_size
    with path.open("rb") as source, target.open("wb") as out:
        while left > 0 and (piece := source.read(min(PIECE, left))):
            out.write(piece)
            left -= len(piece)


def _apply_log(path: Path, copy: RecoveredCopy) -> None:
    with path.open("rb") as log:
        end = committed_end(log, path.stat().st_size, copy.path.stat().st_size)
        _write(copy.path, log_pages(log, end), end.page_size, end.pages if end.committed else None)
        log.seek(0)
        header = log.read(LOG_HEADER.size)
    _note_tail(path, end, header, copy)


def _note_tail(path: Path, end: LogEnd, header: bytes, copy: RecoveredCopy) -> None:
    index = path.with_name(path.name.removesuffix(LOG) + INDEX)
    counted = 0
    if index.is_file():
        with index.open("rb") as file:
            counted = indexed_frames(file.read(64), header)
    if counted > end.committed:
        reason = f"{counted} pages were committed by its {INDEX}, {end.committed} are there"
        copy.losses.append(Damage(f"{path.name}: {reason}; what the others hold is lost"))
    if end.tail:
        copy.tail = f"{end.tail} pages after the last commit are cut or were never committed"
        copy.tail_bytes = end.tail * end.page_size
        copy.tail_rows = end.tail_rows
    elif end.page_size == 0:
        copy.losses.append(Damage(f"{path.name}: is no write-ahead log, so it is left out"))


def _roll_back(path: Path, copy: RecoveredCopy) -> None:
    """Undo the transaction in which the recorder was killed: its messages are half written."""
    with path.open("rb") as journal:
        found = journal_pages(journal, path.stat().st_size)
    if found is None:
        return
    pages, page_size, count = found
    if count * page_size > copy.path.stat().st_size + len(pages) * page_size:
        copy.losses.append(Damage(f"{path.name}: is no journal of this file, so it is left out"))
        return
    _write(copy.path, pages, page_size, count or None)
    reason = "the last transaction was not committed and is undone; its messages are lost"
    copy.losses.append(Damage(f"{path.name}: {reason}"))


def _write(target: Path, pages: Iterable[Page], page_size: int, count: int | None) -> None:
    with target.open("r+b") as file:
        for page in pages:
            if count is None or page.number <= count:
                file.seek((page.number - 1) * page_size)
                file.write(page.content)
        if count is not None:
            os.truncate(file.fileno(), count * page_size)
