"""The digest by which a recording is known, whatever it is called and wherever it lies."""

from __future__ import annotations

import hashlib
from pathlib import Path

from graspe_data.errors import RecordingError
from graspe_data.recordings.layout import storage_files


def recording_digest(path: Path) -> str:
    """Digest the messages of a recording, whatever lies beside them.

    Returns:
        For one file the hexadecimal SHA-256 of its content, in a folder or not; for several the
        SHA-256 over one line a file with its digest, in their order.

    Raises:
        RecordingError: The path does not exist, cannot be read, or holds no recording.
    """
    try:
        digests = [file_digest(file) for file in storage_files(path)]
    except OSError as error:
        raise RecordingError(f"{path}: cannot be read: {error.strerror}.") from error
    if len(digests) == 1:
        return digests[0]
    return hashlib.sha256("".join(f"{digest}\n" for digest in digests).encode()).hexdigest()


def file_digest(path: Path) -> str:
    """The hexadecimal SHA-256 of a file; OSError where it cannot be read."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
