"""Records of an MCAP file: opcode u8, length u64, content.

Content is parsed by the `mcap` package, but for messages, where it is the hot path.
"""

from __future__ import annotations

from collections.abc import Iterator
from io import BytesIO
from struct import Struct
from typing import NamedTuple

from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode
from mcap.records import Channel as McapChannel
from mcap.records import Schema

from graspe_data.recordings.containers.chunks import ChunkSpan
from graspe_data.recordings.containers.storage import Channel
from graspe_data.recordings.foxglove.decoder import ENCODINGS
from graspe_data.recordings.foxglove.messages import KINDS
from graspe_data.recordings.message_types import normalise_type

MAGIC = b"\x89MCAP0\r\n"
PREFIX = Struct("<BQ")
MESSAGE_HEAD = Struct("<HIQQ")
CHUNK_HEAD = Struct("<QQQII")
MAXIMUM_OTHERS = 1 << 16
IMPLIED_ENCODINGS = {
    "ros1msg": "ros1",
    "ros2msg": "cdr",
    "ros2idl": "cdr",
    "omgidl": "cdr",
    "protobuf": "protobuf",
    "jsonschema": "json",
}
CHUNK_COMPRESSIONS = (b"", b"lz4", b"zstd")
DEFINITION_FORMATS = {"ros1msg": "msg", "ros2msg": "msg", "ros2idl": "idl", "omgidl": "idl"}


class McapRecord(NamedTuple):
    """Where a record's content lies."""

    opcode: int
    offset: int
    size: int


def walk_records(content: bytes) -> Iterator[McapRecord]:
    """The whole records of a chunk's content; ValueError at the first that is not."""
    offset = others = 0
    while offset < len(content):
        if offset + PREFIX.size > len(content):
            raise ValueError(f"ends within a record, at byte {offset} of it")
        opcode, size = PREFIX.unpack_from(content, offset)
        if opcode != Opcode.MESSAGE:
            others += 1
            if others > MAXIMUM_OTHERS:
                raise ValueError(f"holds more than {MAXIMUM_OTHERS} records beside messages")
        offset += PREFIX.size
        if offset + size > len(content):
            raise ValueError(f"ends within a record, {offset + size - len(content)} bytes short")
        yield McapRecord(opcode, offset, size)
        offset += size


def walk_messages(content: bytes) -> Iterator[tuple[int, int, memoryview]]:
    """The messages of a chunk's content as (channel, log time in ns, data)."""
    view = memoryview(content)
    for opcode, offset, size in walk_records(content):
        if opcode == Opcode.MESSAGE:
            if size < MESSAGE_HEAD.size:
                raise ValueError(f"has a message of {size} bytes at byte {offset} of it")
            channel, _, log_time, _ = MESSAGE_HEAD.unpack_from(content, offset)
            yield channel, log_time, view[offset + MESSAGE_HEAD.size : offset + size]


def chunk_span(head: bytes, offset: int, available: int) -> ChunkSpan | None:
    """The chunk whose content starts at ``offset`` of the file, or None where no chunk is.

    Args:
        head: The first bytes of the content.
        offset: Where it lies.
        available: How long it is: by its record, or up to the end of the file.
    """
    if len(head) < CHUNK_HEAD.size:
        return None
    start, stop, declared, crc, length = CHUNK_HEAD.unpack_from(head)
    name = head[CHUNK_HEAD.size : CHUNK_HEAD.size + length] if length <= 4 else b"?"  # noqa: PLR2004
    data = CHUNK_HEAD.size + length + 8
    if name not in CHUNK_COMPRESSIONS or available < data:
        return None
    size = min(int.from_bytes(head[data - 8 : data], "little"), available - data)
    return ChunkSpan(offset + data, size, name.decode(), declared, crc, start, stop)


class ChannelTable:
    """Channels as the file defines them, each by the schema that it names."""

    def __init__(self) -> None:
        """Begin without channels."""
        self.channels: dict[int, Channel] = {}
        self._schemas: dict[int, Schema] = {}

    def note(self, opcode: int, content: bytes) -> None:
        """Take a schema or channel record; a broken one is passed over, the first one stays."""
        stream = ReadDataStream(BytesIO(content))
        try:
            if opcode == Opcode.SCHEMA:
                self.add_schema(Schema.read(stream))
            elif opcode == Opcode.CHANNEL:
                self.add_channel(McapChannel.read(stream))
        except Exception:  # noqa: BLE001 - struct, unicode, end of file: the record is broken
            return

    def add_schema(self, schema: Schema) -> None:
        """Add a schema, for the channels that follow."""
        self._schemas.setdefault(schema.id, schema)

    def add_channel(self, channel: McapChannel) -> None:
        """Add a channel, by the schemas added so far."""
        schema = self._schemas.get(channel.schema_id) or Schema(0, b"", "", "")
        encoding = channel.message_encoding or IMPLIED_ENCODINGS.get(schema.encoding, "")
        if encoding in ENCODINGS:
            described = _foreign(channel.topic, encoding, schema)
        else:
            described = Channel(
                channel.topic,
                normalise_type(schema.name),
                encoding,
                schema.data.decode(errors="replace"),
                DEFINITION_FORMATS.get(schema.encoding, "msg"),
            )
        self.channels.setdefault(channel.id, described)


def _foreign(topic: str, encoding: str, schema: Schema) -> Channel:
    """A channel of an encoding that is not of ROS, by the ROS type that says the same."""
    message_type, _ = KINDS.get(schema.name, (schema.name, None))
    return Channel(
        topic,
        message_type,
        encoding,
        schema.data.decode("latin-1"),
        schema.encoding,
        schema=schema.name,
    )
