"""Find the recordings below some paths."""

from __future__ import annotations

import re
from collections.abc import Iterable
from pathlib import Path

from graspe_data.errors import RecordingError

SUFFIXES = (".bag", ".bag.active", ".db3", ".db3.zstd", ".mcap", ".mcap.zstd")
METADATA = "metadata.yaml"


def is_storage_file(path: Path) -> bool:
    """Whether a file is named like a recording or a part of one."""
    return path.is_file() and path.name.endswith(SUFFIXES)


def find_recordings(paths: Iterable[Path]) -> list[Path]:
    """Find recordings: files, ROS 2 folders, and whatever folders of these hold.

    A folder with a ``metadata.yaml`` is one recording. So is one without it whose files are
    numbered parts of one name (``run_0.db3``, ``run_1.db3``). In any other folder every file and
    every folder is looked at.

    Returns:
        The recordings, each once, in the order of the paths and then of their names.

    Raises:
        RecordingError: A path does not exist, or there is no recording below it.
    """
    found: dict[Path, None] = {}
    for path in paths:
        if not path.exists():
            raise RecordingError(f"{path}: no such file or folder.")
        below = list(_below(path))
        if not below:
            raise RecordingError(
                f"{path}: no recording here or below: expected {', '.join(SUFFIXES)} or a folder "
                f"with {METADATA}."
            )
        found.update(dict.fromkeys(below))
    return list(found)


def _below(path: Path) -> Iterable[Path]:
    if path.is_file():
        return [path]
    files = sorted(item for item in path.iterdir() if is_storage_file(item))
    if (path / METADATA).is_file() or _are_parts(files):
        return [path]
    folders = sorted(
        item for item in path.iterdir() if item.is_dir() and not item.name.startswith(".")
    )
    return [*files, *(found for folder in folders for found in _below(folder))]


def _are_parts(files: list[Path]) -> bool:
    numbered = [re.fullmatch(r"(.+)_(\d+)(\.(?:db3|mcap).*)", file.name) for file in files]
    names = {(match[1], match[3]) for match in numbered if match}
    return bool(files) and all(numbered) and len(names) == 1
