"""One process at a time in a folder."""

from __future__ import annotations

import fcntl
import os
import platform
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from graspe_data.errors import GraspeError

_HELD: set[int] = set()


@contextmanager
def hold_folder(
    folder: Path, doing: str, refusal: type[GraspeError], note: str | None = None
) -> Iterator[None]:
    """Hold a folder; the lock ends with the process, however it ends.

    Args:
        folder: It has to be there.
        doing: What for, as in "is building here": of the other process, for the error's text.
        refusal: The error of the caller's room.
        note: Name of a file in the folder which tells who holds it; None writes none.

    Raises:
        refusal: Another process holds it, or it cannot be opened.
    """
    place = folder if note is None else folder / note
    how = os.O_RDONLY if note is None else os.O_RDWR | os.O_CREAT | os.O_NONBLOCK
    try:
        handle = os.open(place, how, 0o644)
    except OSError as error:
        raise refusal(f"{place}: cannot be opened: {error.strerror}.") from error
    _HELD.add(handle)
    try:
        _take(handle, folder, doing, refusal)
        if note is not None:
            os.ftruncate(handle, 0)
            os.pwrite(handle, f"process {os.getpid()} on {platform.node()}\n".encode(), 0)
        yield
    finally:
        _HELD.discard(handle)
        os.close(handle)


def _take(handle: int, folder: Path, doing: str, refusal: type[GraspeError]) -> None:
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError as error:
        raise refusal(
            f"{folder}: {_holder(handle)} is {doing} here. Wait for it, end it, or give another "
            "folder."
        ) from error
    except OSError as error:
        raise refusal(f"{folder}: cannot be locked: {error.strerror}.") from error


def _holder(handle: int) -> str:
    """Who wrote a note; a folder has none."""
    try:
        note = os.pread(handle, 200, 0).decode(errors="replace").strip()
    except IsADirectoryError:
        note = ""
    return note or "another process"


def _let_go() -> None:
    """A child that outlives its killed parent must not hold the parent's folders."""
    for handle in _HELD:
        os.close(handle)
    _HELD.clear()


os.register_at_fork(after_in_child=_let_go)
