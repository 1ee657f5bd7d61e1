"""The digest by which a recording is known, whatever it is called and wherever it lies."""

from __future__ import annotations

import hashlib
from pathlib import Path

from graspe_data.errors import RecordingError


def recording_digest(path: Path) -> str:
    """Digest a recording.

    Returns:
        For a file the hexadecimal SHA-256 of its content; for a folder the SHA-256 over one line
        ``name sha256`` a file, in the order of their names.

    Raises:
        RecordingError: The path does not exist or cannot be read.
    """
    try:
        if not path.is_dir():
            return _file_digest(path)
        files = sorted(item for item in path.iterdir() if item.is_file())
        lines = "".join(f"{item.name} {_file_digest(item)}\n" for item in files)
    except OSError as error:
        raise RecordingError(f"{path}: cannot be read: {error.strerror}.") from error
    return hashlib.sha256(lines.encode()).hexdigest()


def _file_digest(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
