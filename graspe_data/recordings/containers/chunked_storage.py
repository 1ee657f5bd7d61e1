"""What the storages made of chunks, ROS 1 bags and MCAP files, have in common."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Collection, Iterator
from pathlib import Path

from graspe_data.recordings.containers.chunks import ChunkReader, ChunkSpan, positions_of
from graspe_data.recordings.containers.payloads import LostMessages, unpacked
from graspe_data.recordings.containers.storage import Channel, Source
from graspe_data.recordings.messages import Damage, RawMessage


class ChunkedStorage(ABC):
    """One file of chunks: its channels and where its chunks lie, found on opening.

    Args:
        path: The file.
        compressed_messages: Whether every payload is zstd; None to see by their first bytes.
    """

    def __init__(self, path: Path, *, compressed_messages: bool | None = None) -> None:
        """Open the file, and read its index or scan it."""
        self._compressed = compressed_messages
        self._source = Source(path)
        self.losses: list[Damage] = []
        self.channels: dict[int, Channel] = {}
        self.first_position = 0
        self._spans: list[ChunkSpan] = []
        try:
            self._open()
        except BaseException:
            self._source.close()
            raise

    @staticmethod
    @abstractmethod
    def walk(content: bytes) -> Iterator[tuple[int, int, memoryview]]:
        """From a chunk's content to (channel, time in ns, data)."""

    @property
    def positions(self) -> int:
        """How many positions the messages of the file take."""
        return sum(positions_of(span) for span in self._spans)

    @abstractmethod
    def _open(self) -> None:
        """Find channels and chunks."""

    def messages(self, wanted: Collection[int], losses: list[Damage]) -> Iterator[RawMessage]:
        """Yield messages, in time order by the index, in file order without one."""
        reader = ChunkReader(self._source, self.channels, self.walk, self.first_position)
        return unpacked(
            reader.messages(self._spans, wanted, losses),
            self._compressed,
            {channel.topic: channel.encoding for channel in self.channels.values()},
            reader.limit.spend,
            LostMessages(self._source.path.name, losses),
        )

    def close(self) -> None:
        """Close the file."""
        self._source.close()
