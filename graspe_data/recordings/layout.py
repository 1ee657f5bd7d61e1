"""Which files make a recording, in which order, and what its metadata.yaml says."""

from __future__ import annotations

import re
import shutil
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path, PurePosixPath
from typing import Any, Literal

import yaml

from graspe_data.errors import RecordingError
from graspe_data.recordings.containers.decompression import ZSTD_MAGIC, decompress_file
from graspe_data.recordings.containers.sqlite_recovery import log_beside, orphaned_log
from graspe_data.recordings.message_types import normalise_type
from graspe_data.recordings.messages import Damage
from graspe_data.recordings.parts import join_parts, parts_of

MAXIMUM_METADATA = 4 << 20
SHOWN = 5
SUFFIXES = (".bag", ".bag.active", ".mcap", ".mcap.zstd", ".db3", ".db3.zstd")
MAGICS: tuple[tuple[bytes, Literal["rosbag1", "sqlite3", "mcap"]], ...] = (
    (b"#ROSBAG V", "rosbag1"),
    (b"#ROSRECORD V", "rosbag1"),
    (b"#ROSLOG V", "rosbag1"),
    (b"\x89MCAP0\r\n", "mcap"),
    (b"SQLite format 3\0", "sqlite3"),
)


@dataclass
class Layout:
    """The files of a recording, and those to read in their place where they were compressed."""

    path: Path
    files: Sequence[Path]
    format: Literal["rosbag1", "sqlite3", "mcap"]
    readable: Sequence[Path]
    counts: dict[str, int] = field(default_factory=dict)
    topics: dict[str, tuple[str, str]] = field(default_factory=dict)
    compressed_messages: bool | None = None
    losses: list[Damage] = field(default_factory=list)
    temporary: Path | None = None

    def close(self) -> None:
        """Remove what was decompressed."""
        if self.temporary is not None:
            shutil.rmtree(self.temporary, ignore_errors=True)


def find_layout(path: Path) -> Layout:
    """Find the files of a recording, and decompress those that are compressed as a whole.

    Raises:
        RecordingError: There is nothing, or nothing that is a recording.
    """
    losses: list[Damage] = []
    files, metadata = _files_of(path, losses)
    temporary, readable = _decompressed(files, losses)
    formats = [_format_of(file) for file in readable]
    known = next((name for name in formats if name is not None), None)
    if known is None:
        if temporary is not None:
            shutil.rmtree(temporary, ignore_errors=True)
        raise RecordingError(
            f"{path}: neither a ROS 1 bag (#ROSBAG V2.0), nor MCAP, nor SQLite: it begins with "
            f"{_magic(readable[0])[:16]!r}. A recording is needed, or a folder with one."
            f"{orphaned_log(path)}"
        )
    for file, name in zip(readable, formats, strict=True):
        if name != known:
            losses.append(Damage(f"{file.name}: is no {known} file, left out"))
    kept = [file for file, name in zip(readable, formats, strict=True) if name == known]
    layout = Layout(path, files, known, kept, losses=losses, temporary=temporary)
    _note_metadata(layout, metadata)
    return layout


def storage_files(path: Path) -> list[Path]:
    """The files that hold a recording's messages, in order; nothing that lies beside them.

    A part leads to its whole.

    Raises:
        RecordingError: There is no such path, or no recording in the folder, or several.
    """
    return _files_of(path, [])[0]


def listed_with(file: Path) -> list[str]:
    """The names of the files that a metadata.yaml beside a file lists; none without that file."""
    names = _listed(_read_metadata(file.parent, []))
    return names if file.name in names else []


def _files_of(path: Path, losses: list[Damage]) -> tuple[list[Path], dict[str, Any]]:
    """The files of a recording, and its metadata where that joins them."""
    if not path.exists():
        raise RecordingError(f"{path}: there is no such file or folder.")
    if path.is_dir():
        metadata = _read_metadata(path, losses)
        return _files_in(path, metadata, losses), metadata
    if len(listed_with(path)) > 1:
        metadata = _read_metadata(path.parent, losses)
        return _files_in(path.parent, metadata, losses), metadata
    try:
        parts = parts_of(path)
    except OSError:
        return [path], {}
    losses += parts.losses
    return list(parts.files), {}


def _listed(metadata: dict[str, Any]) -> list[str]:
    listed = metadata.get("relative_file_paths")
    return [PurePosixPath(str(name)).name for name in listed] if isinstance(listed, list) else []


def _read_metadata(folder: Path, losses: list[Damage]) -> dict[str, Any]:
    path = folder / "metadata.yaml"
    if not path.is_file():
        return {}
    try:
        if path.stat().st_size > MAXIMUM_METADATA:
            raise ValueError("too large")  # noqa: TRY301
        document = yaml.load(path.read_bytes(), Loader=_loader())  # noqa: S506 - a safe loader
        metadata = document["rosbag2_bagfile_information"]
        if not isinstance(metadata, dict):
            raise TypeError("not a mapping")  # noqa: TRY301
    except Exception as error:  # noqa: BLE001 - whatever a broken document leads to
        reason = (str(error).splitlines() or [""])[0]
        losses.append(Damage(f"metadata.yaml: cannot be read ({reason}); files taken by name"))
        return {}
    return metadata


def _loader() -> type[yaml.SafeLoader]:
    return getattr(yaml, "CSafeLoader", yaml.SafeLoader)


def _files_in(folder: Path, metadata: dict[str, Any], losses: list[Damage]) -> list[Path]:
    """The files that the metadata lists, else all, ``name_2`` before ``name_10``."""
    named = _listed(metadata)
    found = sorted(
        (file for file in folder.iterdir() if file.name.endswith(SUFFIXES) and file.is_file()),
        key=lambda file: [int(part) if part.isdigit() else part for part in _parts(file.name)],
    )
    there = {file.name: file for file in found}
    missing = [name for name in named if name not in there]
    losses += [Damage(f"{name}: listed in metadata.yaml, not in the folder") for name in missing]
    files = [there[name] for name in dict.fromkeys(named) if name in there] or found
    if not files:
        raise RecordingError(
            f"{folder}: no recording in it; expected one of {', '.join(SUFFIXES)}."
            f"{orphaned_log(folder)}"
        )
    return files if (folder / "metadata.yaml").exists() else _the_one(folder, files, losses)


def _the_one(folder: Path, files: list[Path], losses: list[Damage]) -> list[Path]:
    """The files of the only recording of a folder that nothing but their names and times joins."""
    recordings = join_parts(files)
    if len(recordings) > 1:
        shown = ", ".join(parts.head.name for parts in recordings[:SHOWN])
        raise RecordingError(
            f"{folder}: {len(recordings)} recordings, and no metadata.yaml that joins them: {shown}"
            f"{', ...' if len(recordings) > SHOWN else ''}. Name one of them."
        )
    losses += recordings[0].losses
    return list(recordings[0].files)


def _parts(name: str) -> list[str]:
    return re.split(r"([0-9]+)", name)


def _decompressed(files: Sequence[Path], losses: list[Damage]) -> tuple[Path | None, list[Path]]:
    if not any(_magic(file).startswith(ZSTD_MAGIC) for file in files):
        return None, list(files)
    folder = Path(tempfile.mkdtemp(prefix="graspe-"))
    readable = []
    try:
        for number, file in enumerate(files):
            target = file
            if _magic(file).startswith(ZSTD_MAGIC):
                target = folder / f"{number}_{file.name.removesuffix('.zstd')}"
                if fault := decompress_file(file, target):
                    losses.append(Damage(f"{file.name}: the zstd file {fault}"))
            readable.append(target)
    except BaseException:
        shutil.rmtree(folder, ignore_errors=True)
        raise
    return folder, readable


def _magic(path: Path) -> bytes:
    try:
        with path.open("rb") as file:
            return file.read(16)
    except OSError as error:
        raise RecordingError(f"{path}: cannot be read: {error.strerror}.") from error


def _format_of(path: Path) -> Literal["rosbag1", "sqlite3", "mcap"] | None:
    """The format by the first bytes; by the name where those are damaged."""
    magic = _magic(path)
    for beginning, name in MAGICS:
        if magic.startswith(beginning):
            return name
    if path.name.endswith((".bag", ".bag.active")):
        return "rosbag1" if magic else None
    if path.name.endswith(".db3") and not magic and log_beside(path) is not None:
        return "sqlite3"
    return "mcap" if path.name.endswith(".mcap") and magic else None


def _note_metadata(layout: Layout, metadata: dict[str, Any]) -> None:
    """Keep what metadata.yaml says of topics and counts, as far as it makes sense."""
    if str(metadata.get("compression_mode") or "").lower() == "message":
        kind = str(metadata.get("compression_format") or "zstd").lower()
        layout.compressed_messages = True if kind == "zstd" else None
        if kind != "zstd":
            reason = f"its messages are compressed by {kind[:20]!r}, of which only zstd is read"
            layout.losses.append(Damage(f"metadata.yaml: {reason}"))
    entries = metadata.get("topics_with_message_count")
    for entry in entries if isinstance(entries, list) else []:
        try:
            topic = entry["topic_metadata"]
            name, count = str(topic["name"]), entry["message_count"]
            encoding = str(topic.get("serialization_format") or "cdr")
            layout.topics[name] = (normalise_type(str(topic["type"])), encoding)
            layout.counts[name] = layout.counts.get(name, 0) + max(0, int(count))
        except (KeyError, TypeError, ValueError, AttributeError, OverflowError):
            layout.losses.append(Damage("metadata.yaml: an entry of its topics is broken"))
