"""Records of a ROS 1 bag, format 2.0: a header of named fields, then data.

Each is preceded by its length, u32; a field is its length, ``name=`` and the value.
"""

from __future__ import annotations

from collections.abc import Iterator
from struct import Struct
from typing import NamedTuple

MESSAGE, BAG, INDEX, CHUNK, CHUNK_INFO, CONNECTION = 2, 3, 4, 5, 6, 7
MAXIMUM_HEADER = 1 << 20

_U32 = Struct("<I")
TIME = Struct("<II")


class Record(NamedTuple):
    """A record's fields, and where its data lies."""

    op: int
    fields: dict[bytes, bytes]
    data_offset: int
    data_size: int


def u32(fields: dict[bytes, bytes], name: bytes) -> int:
    """A field as unsigned integer of 32 bits; ValueError where it is absent or of another size."""
    value = fields.get(name, b"")
    if len(value) != _U32.size:
        raise ValueError(f"has a record without the field {name.decode()}")
    return int(_U32.unpack(value)[0])


def time_ns(fields: dict[bytes, bytes], name: bytes) -> int:
    """A field as time in ns, from u32 seconds and u32 nanoseconds; ValueError as ``u32``."""
    value = fields.get(name, b"")
    if len(value) != TIME.size:
        raise ValueError(f"has a record without the field {name.decode()}")
    seconds, nanoseconds = TIME.unpack(value)
    return int(seconds) * 1_000_000_000 + int(nanoseconds)


def parse_fields(header: bytes | memoryview) -> dict[bytes, bytes]:
    """Split a header into its fields; ValueError where lengths do not fit."""
    fields: dict[bytes, bytes] = {}
    offset = 0
    header = bytes(header)
    while offset < len(header):
        size = int.from_bytes(header[offset : offset + 4], "little")
        offset += 4
        name, separator, value = header[offset : offset + size].partition(b"=")
        if not separator or offset + size > len(header):
            raise ValueError(f"has a broken record header at byte {offset} of it")
        fields[name] = value
        offset += size
    return fields


def parse_record(buffer: bytes | memoryview, offset: int) -> Record:
    """Parse the record at ``offset``; its data may reach past the buffer, its header may not."""
    head = offset + 4
    size = int.from_bytes(buffer[offset:head], "little")
    if head > len(buffer) or size > MAXIMUM_HEADER or head + size + 4 > len(buffer):
        raise ValueError(f"is cut or broken at byte {offset} of it")
    fields = parse_fields(buffer[head : head + size])
    if len(fields.get(b"op", b"")) != 1:
        raise ValueError(f"has a record without op at byte {offset} of it")
    data = head + size + 4
    return Record(fields[b"op"][0], fields, data, int.from_bytes(buffer[data - 4 : data], "little"))


def walk_records(content: bytes) -> Iterator[Record]:
    """The whole records of a chunk's content; ValueError at the first that is not."""
    offset = 0
    while offset < len(content):
        record = parse_record(content, offset)
        offset = record.data_offset + record.data_size
        _check_whole(offset, len(content))
        yield record


class _MessageHeader:
    """The header of a chunk's message records: the same bytes but for connection, time and size.

    A recorder writes the fields of all its messages in one order, so the places of the two values
    in the first header are their places in every other.
    """

    def __init__(self, header: bytes) -> None:
        conn, time = header.index(b"conn=") + 5, header.index(b"time=") + 5
        ends = (conn + 4, time) if conn < time else (time + 8, conn)
        last = max(conn + 4, time + 8)
        kinds = "IQ" if conn < time else "QI"
        before, between, behind = min(conn, time), ends[1] - ends[0], len(header) - last
        if between < 0 or behind < 0:
            raise ValueError("has a message header whose fields overlap")
        self._layout = Struct(f"<{before + 4}s{kinds[0]}{between}s{kinds[1]}{behind}sI")
        self.size = self._layout.size
        self._conn_first = conn < time
        whole = _U32.pack(len(header)) + header + _U32.pack(0)
        self._fixed = self._layout.unpack(whole)[:5:2]

    def read(self, content: bytes, offset: int) -> tuple[int, int, int] | None:
        """Connection, time in ns and size of the data; None where the header is another."""
        if offset + self.size > len(content):
            return None
        before, one, between, two, behind, size = self._layout.unpack_from(content, offset)
        if (before, between, behind) != self._fixed:
            return None
        conn, time = (one, two) if self._conn_first else (two, one)
        return conn, (time & 0xFFFFFFFF) * 1_000_000_000 + (time >> 32), size


def walk_messages(content: bytes) -> Iterator[tuple[int, int, memoryview]]:
    """The messages of a chunk's content as (connection, time in ns, data).

    ValueError at the first record that is not whole.
    """
    view = memoryview(content)
    header: _MessageHeader | None = None
    offset = 0
    while offset < len(content):
        known = header.read(content, offset) if header else None
        if header is not None and known is not None:
            conn, time, size = known
            start = offset + header.size
            _check_whole(start + size, len(content))
            yield conn, time, view[start : start + size]
            offset = start + size
            continue
        record = parse_record(content, offset)
        start, stop = record.data_offset, record.data_offset + record.data_size
        _check_whole(stop, len(content))
        if record.op == MESSAGE:
            conn, time = u32(record.fields, b"conn"), time_ns(record.fields, b"time")
            header = _MessageHeader(content[offset + 4 : start - 4])
            yield conn, time, view[start:stop]
        offset = stop


def _check_whole(stop: int, size: int) -> None:
    if stop > size:
        raise ValueError(f"ends within a message, {stop - size} bytes short")
