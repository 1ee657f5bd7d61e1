"""The digest by which a recording is known, whatever it is called and wherever it lies."""

from __future__ import annotations

import hashlib
from pathlib import Path

from graspe_data.documents import file_digest
from graspe_data.errors import RecordingError
from graspe_data.recordings.containers.sqlite_recovery import log_beside
from graspe_data.recordings.layout import storage_files


def recording_digest(path: Path) -> str:
    """Digest the messages of a recording, whatever lies beside them.

    The log of a killed recorder holds messages, so it counts: the files of two recorders that were
    killed before they copied anything from it are the same.

    Returns:
        For one file the hexadecimal SHA-256 of its content, in a folder or not; for several, a log
        being one, the SHA-256 over one line a file with its digest, in their order.

    Raises:
        RecordingError: The path does not exist, cannot be read, or holds no recording.
    """
    try:
        digests = [_with_log(file) for file in storage_files(path)]
    except OSError as error:
        raise RecordingError(f"{path}: cannot be read: {error.strerror}.") from error
    return digests[0] if len(digests) == 1 else _joined(digests)


def _with_log(path: Path) -> str:
    log = log_beside(path)
    return file_digest(path) if log is None else _joined([file_digest(path), file_digest(log)])


def _joined(digests: list[str]) -> str:
    return hashlib.sha256("".join(f"{digest}\n" for digest in digests).encode()).hexdigest()
