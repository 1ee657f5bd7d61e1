"""How much work a file may cost: in proportion to its bytes, whatever its records claim."""

from __future__ import annotations

from pathlib import Path

from graspe_data.errors import RecordingError

BYTES_PER_BYTE = 250
FREE_BYTES = 256 << 20
FREE_RECORDS = 1 << 18


class WorkLimit:
    """Counts what one pass over a file takes; beyond the limit the file is refused by name.

    Args:
        path: The file.
        size: Its bytes. A pass may expand them 250 times and 256 MiB, and may walk one record
            a byte and 2^18 more. Recordings stay a tenth below that or less.
    """

    def __init__(self, path: Path, size: int) -> None:
        """Begin a pass."""
        self._path = path
        self._size = size
        self._bytes = FREE_BYTES + BYTES_PER_BYTE * size
        self._records = FREE_RECORDS + size

    @property
    def records_left(self) -> int:
        """How many records may still be walked."""
        return self._records

    def spend(self, expanded: int, records: int) -> None:
        """Note work that was done.

        Raises:
            RecordingError: It is more than any recording of this size takes.
        """
        self._bytes -= expanded
        self._records -= records
        if self._bytes < 0 or self._records < 0:
            kind = "bytes of content" if self._bytes < 0 else "records"
            raise RecordingError(
                f"{self._path}: {self._size} bytes claim to hold more {kind} than they can: "
                f"refused, since reading it would not end. Leave this file out."
            )
