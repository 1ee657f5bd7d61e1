"""What a killed recorder leaves beside an SQLite file: a write-ahead log or a rollback journal.

Formats: sqlite.org/fileformat2.html, sections 3 and 4. Numbers are big-endian.
"""

from __future__ import annotations

import functools
from collections.abc import Iterator
from dataclasses import dataclass, field
from struct import Struct
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

LOG_MAGICS = {0x377F0682: "<u4", 0x377F0683: ">u4"}
LOG_HEADER = Struct(">8I")
FRAME_HEADER = Struct(">6I")
INDEX_SALTS, INDEX_FRAMES = slice(32, 40), slice(16, 20)
JOURNAL_MAGIC = b"\xd9\xd5\x05\xf9\x20\xa1\x63\xd7"
JOURNAL_HEADER = Struct(">8s5I")
ALL_RECORDS = 0xFFFFFFFF
PAGE_SIZES = frozenset(1 << power for power in range(9, 17))
TABLE_LEAF = b"\x0d"
FIRST_PAGE_HEADER = 100

Sums = tuple[int, int]


@dataclass(frozen=True)
class Page:
    """A page to write to the database, numbered from 1."""

    number: int
    content: bytes


@dataclass
class LogEnd:
    """How a log ends: what was committed, and what lies behind it."""

    page_size: int = 0
    committed: int = 0
    pages: int = 0
    """Pages of the database after the last commit."""
    tail: int = 0
    """Frames of this log after the last commit."""
    tail_rows: list[int] = field(default_factory=list)
    """The highest row number of each table page among them."""


def committed_end(log: BinaryIO, size: int, database_size: int) -> LogEnd:
    """Walk a log once: frames count up to the last commit before the first that is not sound."""
    end = LogEnd()
    header = log.read(LOG_HEADER.size)
    if len(header) < LOG_HEADER.size:
        return end
    magic, _, page_size, _, *salts, one, two = LOG_HEADER.unpack(header)
    order = LOG_MAGICS.get(magic)
    if order is None or page_size not in PAGE_SIZES:
        return end
    sums = _checksum(header[:24], (0, 0), order)
    sound = sums == (one, two)
    most_pages = (database_size + size) // page_size + 1
    end.page_size = page_size
    number = 0
    while len(frame := log.read(FRAME_HEADER.size + page_size)) >= FRAME_HEADER.size:
        place, pages, *frame_salts, one, two = FRAME_HEADER.unpack_from(frame)
        if frame_salts != salts:
            break
        number += 1
        content = frame[FRAME_HEADER.size :]
        sound = sound and len(content) == page_size
        if sound:
            sums = _checksum(frame[:8] + content, sums, order)
            sound = sums == (one, two) and 0 < place <= most_pages and pages <= most_pages
        if sound and pages:
            end.committed, end.pages, end.tail_rows = number, pages, []
        else:
            end.tail_rows += _highest_row(content, place)
    end.tail = number - end.committed
    return end


def log_pages(log: BinaryIO, end: LogEnd) -> Iterator[Page]:
    """The committed pages of a log, in order; a later one replaces an earlier."""
    log.seek(LOG_HEADER.size)
    for _ in range(end.committed):
        number = FRAME_HEADER.unpack(log.read(FRAME_HEADER.size))[0]
        yield Page(number, log.read(end.page_size))


def indexed_frames(index: bytes, log_header: bytes) -> int:
    """How many committed frames the ``-shm`` beside a log counts; 0 where it is of another log."""
    if len(index) < INDEX_SALTS.stop or index[INDEX_SALTS] != log_header[16:24]:
        return 0
    return int.from_bytes(index[INDEX_FRAMES], "little")


def journal_pages(journal: BinaryIO, size: int) -> tuple[list[Page], int, int] | None:
    """The pages as they were before the transaction that a crash ended.

    Returns:
        Pages, the size of one, and how many the database had; None where the journal is not hot.
    """
    pages: list[Page] = []
    first: tuple[int, int] | None = None
    offset = 0
    while True:
        journal.seek(offset)
        header = journal.read(JOURNAL_HEADER.size)
        if len(header) < JOURNAL_HEADER.size:
            break
        magic, count, nonce, before, sector, page_size = JOURNAL_HEADER.unpack(header)
        if magic != JOURNAL_MAGIC or page_size not in PAGE_SIZES or sector not in PAGE_SIZES:
            break
        first = first or (page_size, before)
        offset += sector
        whole = max(0, size - offset) // (page_size + 8)
        journal.seek(offset)
        found = list(_journal_records(journal, min(count, whole), page_size, nonce))
        pages += found
        offset += min(count, whole) * (page_size + 8)
        offset += -offset % sector
        if count == ALL_RECORDS or len(found) < count:
            break
    return (pages, *first) if first is not None else None


def _journal_records(journal: BinaryIO, count: int, page_size: int, nonce: int) -> Iterator[Page]:
    for _ in range(count):
        record = journal.read(page_size + 8)
        number = int.from_bytes(record[:4], "big")
        content = record[4:-4]
        total = nonce + sum(content[page_size - 200 : 0 : -200])
        if number == 0 or int.from_bytes(record[-4:], "big") != total & 0xFFFFFFFF:
            return
        yield Page(number, content)


def _checksum(data: bytes, sums: Sums, order: str) -> Sums:
    """The log's running checksum: two sums, each fed by the other, over pairs of words."""
    weights, (power_00, power_01, power_11) = _weights(len(data) // 8)
    words = np.frombuffer(data, order).astype(np.uint64)
    added = (weights * words).sum(axis=1)
    one = power_00 * sums[0] + power_01 * sums[1] + int(added[0])
    two = power_01 * sums[0] + power_11 * sums[1] + int(added[1])
    return one & 0xFFFFFFFF, two & 0xFFFFFFFF


@functools.lru_cache(maxsize=8)
def _weights(pairs: int) -> tuple[NDArray[np.uint64], tuple[int, int, int]]:
    """How much each word adds to both sums after all; and the matrix on the sums before.

    One step is s0 += x0 + s1, s1 += x1 + s0: Fibonacci numbers, two a step, modulo 2^32.
    """
    weights = np.empty((2, 2 * pairs), np.uint64)
    low, middle, high = 1, 0, 1
    for pair in range(pairs - 1, -1, -1):
        weights[:, 2 * pair] = low + middle & 0xFFFFFFFF, middle + high & 0xFFFFFFFF
        weights[:, 2 * pair + 1] = middle, high
        low, middle, high = (
            low + middle & 0xFFFFFFFF,
            middle + high & 0xFFFFFFFF,
            middle + 2 * high & 0xFFFFFFFF,
        )
    return weights, (low, middle, high)


def _highest_row(content: bytes, page: int) -> list[int]:
    """The row number of the last cell of a table's leaf page; none for other pages."""
    start = FIRST_PAGE_HEADER if page == 1 else 0
    cells = int.from_bytes(content[start + 3 : start + 5], "big")
    pointer = start + 8 + 2 * (cells - 1)
    if content[start : start + 1] != TABLE_LEAF or not cells or pointer + 2 > len(content):
        return []
    cell = int.from_bytes(content[pointer : pointer + 2], "big")
    _, after = _varint(content, cell)
    return [_varint(content, after)[0]]


def _varint(content: bytes, offset: int) -> tuple[int, int]:
    value = 0
    for place, byte in enumerate(content[offset : offset + 8]):
        value = value << 7 | byte & 0x7F
        if byte < 0x80:  # noqa: PLR2004
            return value, offset + place + 1
    return 0, offset + 9
