"""Files that appear whole or not at all."""

from __future__ import annotations

import os
import secrets
from collections.abc import Iterable
from pathlib import Path

from graspe_data.errors import FileError, GraspeError

PARTIAL_SUFFIX = ".partial"
# For larger writes Linux takes cache pages of many megabytes, which in a virtual machine the host
# has first to provide: 74 MB at a time cost ten times as much as one (ext4, Linux 6.18).
WRITE_BYTES = 1 << 20


def write_atomically(
    path: Path, pieces: Iterable[bytes | memoryview], refusal: type[GraspeError] = FileError
) -> int:
    """Write a file under a temporary name, sync it, rename it, and sync its folder.

    A process killed on the way leaves at most a hidden file that ends in ``PARTIAL_SUFFIX``; what
    stood at ``path`` before stays until the new file is complete on the disk.

    Args:
        path: The file.
        pieces: Its content, piece by piece; views are of single bytes.
        refusal: The error of the caller's room.

    Returns:
        Bytes written.

    Raises:
        refusal: The folder does not exist or cannot be written, or the disk is full.
    """
    partial = partial_path(path)
    try:
        try:
            written = _write_synced(partial, pieces)
            partial.replace(path)
        finally:
            partial.unlink(missing_ok=True)
        sync_folder(path.parent)
    except OSError as error:
        reason = error.strerror or error
        raise refusal(
            f"{path}: cannot be written: {reason}. Check that the folder exists, that it may be "
            "written and that its disk has space."
        ) from error
    return written


def partial_path(target: Path) -> Path:
    """A name beside a file or folder, hidden and of its own, under which it is made."""
    return target.with_name(f".{target.name}.{secrets.token_hex(4)}{PARTIAL_SUFFIX}")


def sync_folder(folder: Path) -> None:
    """Have the names in a folder on the disk."""
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def _write_synced(path: Path, pieces: Iterable[bytes | memoryview]) -> int:
    with path.open("xb") as file:
        for piece in pieces:
            content = memoryview(piece)
            for start in range(0, len(content), WRITE_BYTES):
                file.write(content[start : start + WRITE_BYTES])
        file.flush()
        os.fsync(file.fileno())
        return file.tell()
