"""Find the recordings below some paths."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path

from graspe_data.errors import RecordingError
from graspe_data.recordings.layout import listed_with
from graspe_data.recordings.parts import Parts, join_parts, numbered_file

SUFFIXES = (".bag", ".bag.active", ".db3", ".db3.zstd", ".mcap", ".mcap.zstd")
METADATA = "metadata.yaml"


def is_storage_file(path: Path) -> bool:
    """Whether a file is named like a recording or a part of one."""
    return path.is_file() and path.name.endswith(SUFFIXES)


def find_recordings(paths: Iterable[Path]) -> list[Path]:
    """Find recordings: files, ROS 2 folders, and whatever folders of these hold.

    A folder with a ``metadata.yaml`` is one recording. So is one without it whose files are the
    numbered parts of one ROS 2 recording (``run_0.db3``, ``run_1.db3``). In any other folder every
    file and every folder is looked at. Parts of one recording, see ``join_parts``, are found as
    their first one, whichever of them is named.

    Returns:
        The recordings, each once, in the order of the paths and then of their names.

    Raises:
        RecordingError: A path does not exist, or there is no recording below it.
    """
    found: dict[Path, None] = {}
    folders: dict[Path, list[Parts]] = {}
    for path in paths:
        if not path.exists():
            raise RecordingError(f"{path}: no such file or folder.")
        below = _below(path, folders)
        if not below:
            raise RecordingError(
                f"{path}: no recording here or below: expected {', '.join(SUFFIXES)} or a folder "
                f"with {METADATA}."
            )
        found.update(dict.fromkeys(below))
    return list(found)


def _below(path: Path, folders: dict[Path, list[Parts]]) -> list[Path]:
    if path.is_file():
        return [_whole(path, folders)]
    if (path / METADATA).is_file():
        return [path]
    joined = _joined(path, folders)
    if _fill_folder(joined):
        return [path]
    below = sorted(
        item for item in path.iterdir() if item.is_dir() and not item.name.startswith(".")
    )
    heads = [parts.head for parts in joined]
    return [*heads, *(found for folder in below for found in _below(folder, folders))]


def _whole(file: Path, folders: dict[Path, list[Parts]]) -> Path:
    """The recording that a file is a part of: its first part, or its folder where that is all."""
    if not is_storage_file(file):
        return file
    try:
        if len(listed_with(file)) > 1:
            return file.parent
        joined = _joined(file.parent, folders)
    except OSError:
        return file
    parts = next((parts for parts in joined if file in parts.files), Parts((file,)))
    return file.parent if len(parts.files) > 1 and _fill_folder(joined) else parts.head


def _joined(folder: Path, folders: dict[Path, list[Parts]]) -> list[Parts]:
    """The recordings that the files of a folder are, found once a folder."""
    if folder not in folders:
        files = sorted(item for item in folder.iterdir() if is_storage_file(item))
        folders[folder] = join_parts(files)
    return folders[folder]


def _fill_folder(joined: Sequence[Parts]) -> bool:
    """Whether the files of a folder are the numbered parts of one ROS 2 recording."""
    if len(joined) != 1:
        return False
    numbered = numbered_file(joined[0].head)
    return numbered is not None and numbered.family[1] != "bag"
