"""What every container format reads from, and what it gives to a `Recording`."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from graspe_data.errors import RecordingError
from graspe_data.recordings.messages import Damage, RawMessage

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


MAXIMUM_TIME = (1 << 63) - 1


@dataclass(frozen=True)
class Channel:
    """One publisher's topic: its type and the definition of that type, empty where absent.

    ``schema`` is the name that the file gives, where its encoding is not one of ROS; the definition
    is then the schema's bytes, one character each.
    """

    topic: str
    message_type: str
    encoding: str
    definition: str = ""
    definition_format: str = "msg"
    count: int | None = None
    schema: str = ""


class Storage(Protocol):
    """One file of a recording, open for reading."""

    losses: list[Damage]
    """What was found missing on opening."""
    first_position: int
    """What the positions of its messages begin after: where those of the file before end."""

    @property
    def positions(self) -> int:
        """How many positions the messages of the file take at most."""

    @property
    def channels(self) -> Mapping[int, Channel]:
        """The channels by their number in the file."""

    def messages(self, wanted: Collection[int], losses: list[Damage]) -> Iterator[RawMessage]:
        """Yield the messages of some channels; append to ``losses`` what is found missing."""

    def close(self) -> None:
        """Close the file."""
