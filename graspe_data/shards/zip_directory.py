"""Where the members of a zip file of stored members lie; every offset is checked."""

from __future__ import annotations

import mmap
import struct
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import pairwise

from graspe_data.shards.zip_container import ENTRY_LIMIT, SIZE_LIMIT

_LONGEST_COMMENT = 0xFFFF
_END_SIZE = 22
_ENTRY_SIZE = 46
_HEADER_SIZE = 30


@dataclass(frozen=True)
class Extent:
    """Where the content of a member lies: offset and size in bytes, and its declared CRC-32."""

    name: str
    offset: int
    size: int
    crc: int


def read_directory(file: mmap.mmap | bytes) -> dict[str, Extent]:
    """Read the central directory and the local headers it points at.

    Raises:
        ValueError: Not a zip file, cut short, compressed, encrypted, or with members that overlap,
            repeat a name or lie outside the file.
    """
    try:
        count, size, begin = _locate(file)
        entries = file[begin : begin + size]
        extents = [_content(file, entry, begin) for entry in _entries(entries, count)]
    except struct.error as error:
        raise ValueError("its zip directory is cut short") from error
    _refuse_overlap(extents)
    return {extent.name: extent for extent in extents}


def _locate(file: mmap.mmap | bytes) -> tuple[int, int, int]:
    """Count of members, size and offset of the central directory."""
    end = file.rfind(b"PK\5\6", max(0, len(file) - _LONGEST_COMMENT - _END_SIZE))
    if end < 0:
        raise ValueError("it does not end as a zip file does, so it is cut short or none")
    *_, count, size, begin, comment = struct.unpack_from("<4H2IH", file, end + 4)
    if end + _END_SIZE + comment != len(file):
        raise ValueError("bytes follow the end of the zip file")
    if count == ENTRY_LIMIT or SIZE_LIMIT in (size, begin):
        end, count, size, begin = _locate_64(file, end)
    if begin + size > end or count * _ENTRY_SIZE > size:
        raise ValueError(f"its directory of {count} members at byte {begin} does not fit")
    return count, size, begin


def _locate_64(file: mmap.mmap | bytes, end: int) -> tuple[int, int, int, int]:
    magic, _, where, _ = struct.unpack_from("<4sIQI", file, max(0, end - 20))
    if magic != b"PK\6\7" or where + 56 > end or file[where : where + 4] != b"PK\6\6":
        raise ValueError("its 64-bit directory is missing")
    return where, *struct.unpack_from("<QQQ", file, where + 32)


def _entries(directory: bytes, count: int) -> Iterator[Extent]:
    """The members as the central directory has them, with the offset of their local header."""
    position = 0
    for _ in range(count):
        if directory[position : position + 4] != b"PK\1\2":
            raise ValueError(f"its directory is damaged at byte {position}")
        _, _, flags, method, _, _, crc, packed, size, *lengths = struct.unpack_from(
            "<6H3I3H", directory, position + 4
        )
        header = struct.unpack_from("<I", directory, position + 42)[0]
        begin = position + _ENTRY_SIZE
        raw, extra = _cut(directory, begin, lengths)
        position = begin + sum(lengths)
        name = raw.decode("utf-8", "replace")
        if method or flags & 1 or packed != size:
            raise ValueError(f"member {name!r} is compressed or encrypted, not stored")
        if SIZE_LIMIT in (size, header):
            size, header = _wide(extra, size, header, name)
        yield Extent(name, header, size, crc)


def _cut(directory: bytes, begin: int, lengths: list[int]) -> tuple[bytes, bytes]:
    name_end = begin + lengths[0]
    if begin + sum(lengths) > len(directory):
        raise ValueError(f"its directory is cut short at byte {begin}")
    return directory[begin:name_end], directory[name_end : name_end + lengths[1]]


def _wide(extra: bytes, size: int, header: int, name: str) -> tuple[int, int]:
    """Take 64-bit size and offset from the extra record where the 32-bit fields are full."""
    position = 0
    while position + 4 <= len(extra):
        record, length = struct.unpack_from("<HH", extra, position)
        if record == 1:
            values = iter(struct.unpack_from(f"<{length // 8}Q", extra, position + 4))
            if size == SIZE_LIMIT:
                size = next(values, -1)
                next(values, None)
            return size, next(values, -1) if header == SIZE_LIMIT else header
        position += 4 + length
    raise ValueError(f"member {name!r} has no 64-bit size")


def _content(file: mmap.mmap | bytes, entry: Extent, limit: int) -> Extent:
    """Replace the offset of the local header by that of the content behind it."""
    if not 0 <= entry.offset <= limit - _HEADER_SIZE or entry.size < 0:
        raise ValueError(f"member {entry.name!r} lies outside the file")
    header = struct.unpack_from("<4s5H3I2H", file, entry.offset)
    begin = entry.offset + _HEADER_SIZE + header[-2] + header[-1]
    name = file[entry.offset + _HEADER_SIZE : entry.offset + _HEADER_SIZE + header[-2]]
    if header[0] != b"PK\3\4" or header[3] or name.decode("utf-8", "replace") != entry.name:
        raise ValueError(f"member {entry.name!r} has a damaged local header")
    if begin + entry.size > limit:
        raise ValueError(f"member {entry.name!r} of {entry.size} bytes runs past its end")
    return Extent(entry.name, begin, entry.size, entry.crc)


def _refuse_overlap(extents: Iterable[Extent]) -> None:
    ordered = sorted(extents, key=lambda extent: (extent.offset, extent.size))
    for first, second in pairwise(ordered):
        if first.offset + first.size > second.offset:
            raise ValueError(f"members {first.name!r} and {second.name!r} overlap")
    names = [extent.name for extent in ordered]
    if len(set(names)) != len(names):
        raise ValueError("two members have the same name")
