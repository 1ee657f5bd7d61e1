"""A file read by offset, within its bounds."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

from graspe_data.errors import RecordingError

WINDOW = 1 << 20
OVERLAP = 256


class Source:
    """A file open for reading; every read stays inside it, whatever sizes the file claims."""

    def __init__(self, path: Path) -> None:
        """Open a file; RecordingError where that fails."""
        self.path = path
        try:
            self._file = path.open("rb", buffering=1 << 16)
            self.size = self._file.seek(0, 2)
        except OSError as error:
            raise RecordingError(f"{path}: cannot be opened: {error.strerror}.") from error

    def read(self, offset: int, size: int) -> bytes:
        """Read up to ``size`` bytes at ``offset``; fewer where the file ends, never an error."""
        if not 0 <= offset < self.size or size <= 0:
            return b""
        try:
            self._file.seek(offset)
            return self._file.read(min(size, self.size - offset))
        except OSError as error:
            raise RecordingError(
                f"{self.path}: cannot be read at byte {offset}: {error.strerror}. "
                f"Check the disk or the network share."
            ) from error

    def search_all(self, pattern: re.Pattern[bytes]) -> Iterator[int]:
        """The offsets of all matches in one pass; a match spans 256 bytes at most."""
        for offset in range(0, self.size, WINDOW):
            for match in pattern.finditer(self.read(offset, WINDOW + OVERLAP)):
                if match.start() < WINDOW:
                    yield offset + match.start()

    def close(self) -> None:
        """Close the file."""
        self._file.close()
