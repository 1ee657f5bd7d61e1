"""One training at a time in a run's folder."""

from __future__ import annotations

import fcntl
import os
import platform
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from graspe_data.errors import ZooError

LOCK_FILE = ".lock"
_HELD: set[int] = set()


@contextmanager
def locked(out: Path) -> Iterator[None]:
    """Hold a run's folder; the lock ends with the process, however it ends.

    Raises:
        ZooError: Another process holds it, or no file can be written there.
    """
    path = out / LOCK_FILE
    try:
        handle = os.open(path, os.O_RDWR | os.O_CREAT | os.O_NONBLOCK, 0o644)
    except OSError as error:
        raise ZooError(f"{path}: cannot be written: {error.strerror}.") from error
    _HELD.add(handle)
    try:
        _take(handle, path)
        yield
    finally:
        _HELD.discard(handle)
        os.close(handle)


def _take(handle: int, path: Path) -> None:
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError as error:
        holder = os.pread(handle, 200, 0).decode(errors="replace").strip() or "another process"
        raise ZooError(
            f"{path.parent}: {holder} is training here. Wait for it, end it, or give another "
            "folder."
        ) from error
    except OSError as error:
        raise ZooError(f"{path}: cannot be locked: {error.strerror}.") from error
    os.ftruncate(handle, 0)
    os.pwrite(handle, f"process {os.getpid()} on {platform.node()}\n".encode(), 0)


def _let_go() -> None:
    """A reader of batches that outlives a killed training must not hold its folder."""
    for handle in _HELD:
        os.close(handle)
    _HELD.clear()


os.register_at_fork(after_in_child=_let_go)
