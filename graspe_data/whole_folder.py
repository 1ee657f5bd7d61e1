"""Folders that appear whole or not at all, and what killed processes leave behind."""

from __future__ import annotations

import glob
import shutil
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from graspe_data.atomic_file import PARTIAL_SUFFIX, partial_path, sync_folder
from graspe_data.errors import FileError
from graspe_data.folder_lock import hold_folder


@contextmanager
def whole_folder(target: Path) -> Iterator[Path]:
    """Yield a temporary folder that becomes ``target`` when the block ends without an error.

    Where another process makes the same target first, its folder stays: for targets of whose name
    the content follows. The files are not synced: what a power cut leaves of them is to be found
    out by their digests when the folder is used again.
    """
    target.parent.mkdir(parents=True, exist_ok=True)
    partial = partial_path(target)
    partial.mkdir()
    try:
        yield partial
        _rename_unless_there(partial, target)
    finally:
        shutil.rmtree(partial, ignore_errors=True)


@contextmanager
def replaced_folder(target: Path) -> Iterator[Path]:
    """Yield a temporary folder that takes the place of ``target``, which may be there or not.

    Whoever writes into it syncs its files (``write_atomically`` does); the rename is synced here.
    """
    target.parent.mkdir(parents=True, exist_ok=True)
    partial, former = partial_path(target), partial_path(target)
    partial.mkdir()
    try:
        yield partial
        if target.exists():
            target.rename(former)
        partial.rename(target)
        sync_folder(target.parent)
    finally:
        shutil.rmtree(partial, ignore_errors=True)
        shutil.rmtree(former, ignore_errors=True)


@contextmanager
def workplace(target: Path) -> Iterator[Path]:
    """Yield a hidden folder beside ``target`` that is gone afterwards, to make files in.

    No other process writes to it. Those that killed processes left beside the same target go.
    """
    for left in target.parent.glob(f".{glob.escape(target.name)}.*{PARTIAL_SUFFIX}"):
        with suppress(OSError, FileError), hold_folder(left, "at work", FileError):
            shutil.rmtree(left)
    folder = partial_path(target)
    folder.mkdir()
    try:
        with hold_folder(folder, "at work", FileError):
            yield folder
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def sweep(folder: Path) -> None:
    """Remove what a killed process left under temporary names, at any depth."""
    for path in list(folder.rglob(f".*{PARTIAL_SUFFIX}")):
        if path.is_dir():
            shutil.rmtree(path, ignore_errors=True)
        else:
            path.unlink(missing_ok=True)


def _rename_unless_there(partial: Path, target: Path) -> None:
    try:
        if not target.exists():
            partial.rename(target)
    except OSError:
        if not target.is_dir():
            raise
