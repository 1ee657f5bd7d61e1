"""Folders of files that appear whole or not at all, and what a killed run leaves behind."""

from __future__ import annotations

import fcntl
import os
import shutil
import uuid
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from graspe_data.atomic_file import PARTIAL_SUFFIX
from graspe_data.errors import StageError


@contextmanager
def committed_folder(target: Path) -> Iterator[Path]:
    """Yield a temporary folder that becomes ``target`` when the block ends without an error.

    Where another process commits the same target first, its folder stays: the same key gives the
    same bytes. The files are not synced: what a power cut leaves of them is found out by their
    digests when the folder is used again, and done again.
    """
    target.parent.mkdir(parents=True, exist_ok=True)
    partial = target.parent / f".{target.name}.{uuid.uuid4().hex[:8]}{PARTIAL_SUFFIX}"
    partial.mkdir()
    try:
        yield partial
        _rename_unless_there(partial, target)
    finally:
        shutil.rmtree(partial, ignore_errors=True)


def _rename_unless_there(partial: Path, target: Path) -> None:
    try:
        if not target.exists():
            partial.rename(target)
    except OSError:
        if not target.is_dir():
            raise


def sweep(folder: Path) -> None:
    """Remove what a killed run left under temporary names."""
    for path in list(folder.rglob(f".*{PARTIAL_SUFFIX}")):
        if path.is_dir():
            shutil.rmtree(path, ignore_errors=True)
        else:
            path.unlink(missing_ok=True)


@contextmanager
def only_builder(folder: Path) -> Iterator[None]:
    """Hold a folder for one build; the lock ends with the process, however it ends.

    Raises:
        StageError: It cannot be made, other files lie in it, or another build is at work there.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        handle = os.open(folder, os.O_RDONLY)
    except OSError as error:
        raise StageError(
            f"{folder}: cannot be the dataset's folder: {error.strerror}. Give another --out."
        ) from error
    try:
        _check_ours(folder)
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError as error:
        raise StageError(
            f"{folder}: another build is at work here. Wait for it, or give another --out."
        ) from error
    else:
        yield
    finally:
        os.close(handle)


def _check_ours(folder: Path) -> None:
    names = sorted(path.name for path in folder.iterdir())
    if {"episodes", "dataset.json"} & set(names):
        return
    if others := [name for name in names if not name.endswith(PARTIAL_SUFFIX)]:
        raise StageError(
            f"{folder}: holds other files ({', '.join(others[:3])}), so it is no place for a "
            f"dataset. Give a new folder to --out."
        )
