"""A zip file of stored members whose contents begin on aligned offsets."""

from __future__ import annotations

import struct
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

ALIGNMENT = 64
ENTRY_LIMIT = 0xFFFF
SIZE_LIMIT = 0xFFFFFFFF

_UNIX = 3 << 8
_READABLE = 0o100644 << 16
_JANUARY_1980 = (0, 0x21)
_ALIGNMENT_RECORD = 0xD935
_ZIP64_RECORD = 0x0001


@dataclass(frozen=True)
class StoredMember:
    """A member to write: its name (ASCII), CRC-32, and the buffers that make up its content."""

    name: str
    crc: int
    buffers: tuple[bytes | memoryview, ...]

    @property
    def size(self) -> int:
        """Bytes of content."""
        return sum(len(buffer) for buffer in self.buffers)


def container_pieces(
    members: Sequence[StoredMember], *, zip64: bool | None = None
) -> Iterator[bytes | memoryview]:
    """Yield the bytes of the zip file in order; the same members give the same bytes.

    Local headers are padded by a well-formed extra record (id 0xD935, as Android's zipalign), so
    that every content begins at a multiple of 64 bytes. Times are 1980-01-01.

    Args:
        members: What to store, in the order in which it shall lie.
        zip64: Force or forbid 64-bit sizes; None takes them where 32 bits do not hold.
    """
    if zip64 is None:
        room = sum(member.size + 512 for member in members)
        zip64 = room >= SIZE_LIMIT or len(members) >= ENTRY_LIMIT
    offset = 0
    directory = []
    for member in members:
        header = _local_header(member, offset, zip64)
        directory.append(_directory_entry(member, offset, zip64))
        offset += len(header) + member.size
        yield header
        yield from member.buffers
    entries = b"".join(directory)
    yield entries
    yield _end(len(members), len(entries), offset, zip64)


def _local_header(member: StoredMember, offset: int, zip64: bool) -> bytes:
    name = member.name.encode("ascii")
    size = SIZE_LIMIT if zip64 else member.size
    sizes = struct.pack("<HHQQ", _ZIP64_RECORD, 16, member.size, member.size) if zip64 else b""
    extra = sizes + _alignment_record(offset + 30 + len(name) + len(sizes))
    fixed = (45 if zip64 else 20, 0, 0, *_JANUARY_1980, member.crc, size, size)
    return struct.pack("<4s5H3I2H", b"PK\3\4", *fixed, len(name), len(extra)) + name + extra


def _alignment_record(offset: int) -> bytes:
    """The extra record after which an offset is aligned: id, size, alignment, zeros."""
    length = 6 + (-offset - 6) % ALIGNMENT
    return struct.pack("<HHH", _ALIGNMENT_RECORD, length - 4, ALIGNMENT).ljust(length, b"\0")


def _directory_entry(member: StoredMember, offset: int, zip64: bool) -> bytes:
    name = member.name.encode("ascii")
    size, where, extra, version = member.size, offset, b"", 20
    if zip64:
        extra = struct.pack("<HHQQQ", _ZIP64_RECORD, 24, size, size, where)
        size, where, version = SIZE_LIMIT, SIZE_LIMIT, 45
    fixed = (_UNIX | version, version, 0, 0, *_JANUARY_1980, member.crc, size, size)
    lengths = (len(name), len(extra), 0, 0, 0, _READABLE, where)
    return struct.pack("<4s6H3I5H2I", b"PK\1\2", *fixed, *lengths) + name + extra


def _end(count: int, size: int, offset: int, zip64: bool) -> bytes:
    if not zip64:
        return struct.pack("<4s4H2IH", b"PK\5\6", 0, 0, count, count, size, offset, 0)
    counts = (0, 0, count, count, size, offset)
    end64 = struct.pack("<4sQHHIIQQQQ", b"PK\6\6", 44, _UNIX | 45, 45, *counts)
    locator = struct.pack("<4sIQI", b"PK\6\7", 0, offset + size, 1)
    full = (0, 0, ENTRY_LIMIT, ENTRY_LIMIT, SIZE_LIMIT, SIZE_LIMIT, 0)
    return end64 + locator + struct.pack("<4s4H2IH", b"PK\5\6", *full)
