"""Recordings that the tests write themselves, and the real ones where they are at hand."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from graspe_data.recordings import Recording, RecordingWriter, open_recording
from graspe_data.recordings.message_types import message_classes
from graspe_data.recordings.writing import Compression, Container

START = 1_700_000_000_000_000_000
STEP = 100_000_000

Triple = tuple[str, int, bytes]
Write = Callable[..., Path]


def _messages(count: int) -> Iterator[tuple[str, object, int]]:
    classes: Any = message_classes()
    random = np.random.default_rng(7)
    for number in range(count):
        time_ns = START + number * STEP
        stamp = classes["builtin_interfaces/msg/Time"](time_ns // 10**9, time_ns % 10**9)
        header = classes["std_msgs/msg/Header"](stamp, "camera")
        picture = random.integers(0, 60, 700, dtype=np.uint8)
        yield (
            "/camera",
            classes["sensor_msgs/msg/CompressedImage"](header, "jpeg", picture),
            time_ns + 5,
        )
        yield "/words", classes["std_msgs/msg/String"](f"number {number}"), time_ns + 9


@pytest.fixture
def write(tmp_path: Path) -> Write:
    """Write ``count`` pictures and words in small chunks; gives the path to open."""

    def write_recording(
        container: Container,
        compression: Compression = "none",
        count: int = 60,
        name: str = "drive",
        chunk_bytes: int = 8000,
    ) -> Path:
        path = tmp_path / (f"{name}.bag" if container == "bag" else name)
        with RecordingWriter(path, container, compression) as writer:
            for topic, message, time_ns in _messages(count):
                writer.write(topic, message, time_ns)
                _close_chunk(writer, chunk_bytes)
        return path

    return write_recording


def _close_chunk(writer: RecordingWriter, chunk_bytes: int) -> None:
    """Make chunks as small as a test wants, which rosbags leaves at 1 MiB."""
    inner: Any = writer._writer
    if writer.container == "bag":
        inner.chunk_threshold = chunk_bytes
    elif writer.container == "mcap" and inner.storage.chunk.bio.tell() > chunk_bytes:
        inner.storage.close_chunk()


@pytest.fixture
def triples() -> Callable[[Recording], list[Triple]]:
    """The messages of a recording as (topic, bag time, bytes)."""

    def read(recording: Recording) -> list[Triple]:
        return [(raw.topic, raw.bag_time_ns, bytes(raw.data)) for raw in recording.messages()]

    return read


@pytest.fixture
def read(triples: Callable[[Recording], list[Triple]]) -> Callable[[Path], list[Triple]]:
    """Open a path and give its messages, after checking that a second pass gives the same."""

    def read_path(path: Path) -> list[Triple]:
        with open_recording(path) as recording:
            found = triples(recording)
            assert triples(recording) == found
            return found

    return read_path


@pytest.fixture
def single() -> Callable[[Path], Path]:
    """The one storage file of a recording."""

    def find(path: Path) -> Path:
        if path.is_file():
            return path
        return next(file for file in path.iterdir() if file.name != "metadata.yaml")

    return find


@pytest.fixture
def real_messages(recordings: Path) -> Callable[[str, str], Iterator[tuple[Any, str]]]:
    """The messages on a topic of a real recording, with their type."""

    def messages(name: str, topic: str) -> Iterator[tuple[Any, str]]:
        with open_recording(recordings / name) as recording:
            for raw in recording.messages([topic]):
                yield recording.decode(raw), recording.topics[topic].message_type

    return messages
