"""Write recordings: one message after another, in any of the three containers."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from types import TracebackType
from typing import Any, Literal, Self, cast

import lz4.frame
from rosbags import rosbag1, rosbag2
from rosbags.interfaces import Connection
from rosbags.rosbag2.storage_mcap import McapWriter
from rosbags.typesys.store import Typestore

from graspe_data.errors import RecordingError
from graspe_data.recordings.message_types import default_typestore, normalise_type, wire_layout

Container = Literal["bag", "db3", "mcap"]
Compression = Literal["none", "bz2", "lz4", "zstd", "zstd_message", "zstd_file"]

COMPRESSIONS: dict[Container, tuple[Compression, ...]] = {
    "bag": ("none", "bz2", "lz4"),
    "db3": ("none", "zstd_message", "zstd_file"),
    "mcap": ("none", "lz4", "zstd"),
}


class RecordingWriter:
    """Write one recording: a ``.bag`` file, or a folder with a db3 or MCAP file and its metadata.

    The same messages give the same bytes. Leaving the ``with`` block finishes the recording;
    leaving it by an exception abandons it without index, as a crash would.

    Args:
        path: The file (``bag``) or folder (``db3``, ``mcap``) to create; it must not exist.
        container: ``bag``, ``db3`` or ``mcap``.
        compression: ``bag``: none, bz2, lz4. ``mcap``: none, lz4, zstd. ``db3``: none,
            zstd_message (each payload), zstd_file (the whole file).

    Raises:
        RecordingError: The path exists, or the container has no such compression.
    """

    def __init__(self, path: Path, container: Container, compression: Compression = "none") -> None:
        """Check the arguments; the file appears on entering the block."""
        if compression not in COMPRESSIONS[container]:
            raise RecordingError(
                f"{path}: {container} has no compression {compression!r}; "
                f"choose one of {', '.join(COMPRESSIONS[container])}."
            )
        if path.exists():
            raise RecordingError(f"{path}: exists already; choose another name or remove it.")
        self.path = path
        self.container = container
        self._store = default_typestore("cdr")
        self._connections: dict[str, tuple[str, Connection]] = {}
        self._writer: Any = _bag(path, compression) if container == "bag" else None
        if self._writer is None:
            self._writer = _rosbag2(path, container, compression)
        self._open: Callable[[], None] = self._writer.open
        self._compression = compression

    def __enter__(self) -> Self:
        """Create the file."""
        try:
            self._open()
        except Exception as error:
            raise RecordingError(f"{self.path}: cannot be created: {error}") from error
        if self.container == "mcap" and self._compression == "lz4":
            storage = cast("McapWriter", self._writer.storage)
            storage.compression, storage.compressor = "lz4", lz4.frame.compress
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Finish the recording, or abandon it after an exception."""
        self._writer.__exit__(kind, error, trace)

    def write(self, topic: str, message: object, bag_time_ns: int) -> None:
        """Append one message.

        Args:
            topic: Its topic; a topic has one type.
            message: An object of one of `message_classes()`.
            bag_time_ns: When the recorder received it.

        Raises:
            RecordingError: The topic had another type before, the message does not serialise, or
                ROS 1 has no message of this layout.
        """
        message_type = normalise_type(str(getattr(message, "__msgtype__", "")))
        known, connection = self._connections.get(topic) or self._connect(topic, message_type)
        if known != message_type:
            raise RecordingError(f"{self.path}: topic {topic} is {known}, not {message_type}.")
        try:
            data = self._store.serialize_cdr(message, message_type, little_endian=True)
            if self.container == "bag":
                data = self._store.cdr_to_ros1(data, message_type)
            self._writer.write(connection, bag_time_ns, data)
        except Exception as error:
            raise RecordingError(
                f"{self.path}: topic {topic} at {bag_time_ns} ns: a {message_type} that does not "
                f"serialise: {error}"
            ) from error

    def _connect(self, topic: str, message_type: str) -> tuple[str, Connection]:
        store = self._store
        if self.container == "bag":
            store = default_typestore("ros1")
            if not _alike(store, self._store, message_type):
                raise RecordingError(
                    f"{self.path}: topic {topic}: ROS 1 has no {message_type} of this layout; "
                    f"write it to db3 or mcap."
                )
        connection = cast(
            "Connection", self._writer.add_connection(topic, message_type, typestore=store)
        )
        self._connections[topic] = (message_type, connection)
        return self._connections[topic]


def _bag(path: Path, compression: Compression) -> rosbag1.Writer:
    writer = rosbag1.Writer(path)
    if compression != "none":
        writer.set_compression(rosbag1.Writer.CompressionFormat[compression.upper()])
    return writer


def _rosbag2(path: Path, container: Container, compression: Compression) -> rosbag2.Writer:
    plugin = rosbag2.StoragePlugin.MCAP if container == "mcap" else rosbag2.StoragePlugin.SQLITE3
    writer = rosbag2.Writer(path, version=9, storage_plugin=plugin)
    modes = {
        "zstd": rosbag2.CompressionMode.STORAGE,
        "zstd_message": rosbag2.CompressionMode.MESSAGE,
        "zstd_file": rosbag2.CompressionMode.FILE,
    }
    if compression in modes:
        writer.set_compression(modes[compression], rosbag2.CompressionFormat.ZSTD)
    return writer


def _alike(ros1: Typestore, ros2: Typestore, message_type: str) -> bool:
    """Whether both generations put the same fields on the wire."""
    if message_type not in ros1.fielddefs or message_type not in ros2.fielddefs:
        return False
    return wire_layout(ros1, message_type) == wire_layout(ros2, message_type)
