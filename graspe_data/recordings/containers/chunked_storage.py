"""What the storages made of chunks, ROS 1 bags and MCAP files, have in common."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Collection, Iterator
from pathlib import Path

from graspe_data.recordings.containers.chunks import ChunkReader, ChunkSpan
from graspe_data.recordings.containers.source import Source
from graspe_data.recordings.containers.storage import Channel
from graspe_data.recordings.messages import Loss, RawMessage


class ChunkedStorage(ABC):
    """One file of chunks: its channels and where its chunks lie, found on opening."""

    def __init__(self, path: Path) -> None:
        """Open the file, and read its index or scan it."""
        self._source = Source(path)
        self.losses: list[Loss] = []
        self.channels: dict[int, Channel] = {}
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

    @abstractmethod
    def _open(self) -> None:
        """Find channels and chunks."""

    def messages(self, wanted: Collection[int], losses: list[Loss]) -> Iterator[RawMessage]:
        """Yield messages, in time order by the index, in file order without one."""
        reader = ChunkReader(self._source, self.channels, self.walk)
        return reader.messages(self._spans, wanted, losses)

    def close(self) -> None:
        """Close the file."""
        self._source.close()
