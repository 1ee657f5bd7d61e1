"""Bags without a usable index: cut, unindexed, ``.bag.active``, or damaged in the middle."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, replace

from graspe_data.recordings.containers.chunks import ChunkSpan, read_content
from graspe_data.recordings.containers.rosbag1_records import (
    BAG,
    CHUNK,
    CHUNK_INFO,
    CONNECTION,
    INDEX,
    MESSAGE,
    TIME,
    Record,
    parse_fields,
    parse_record,
    u32,
    walk_records,
)
from graspe_data.recordings.containers.source import Source
from graspe_data.recordings.containers.storage import Channel
from graspe_data.recordings.message_types import normalise_type
from graspe_data.recordings.messages import Loss

FIRST_RECORD = 13
INDEX_ENTRY = 12
PREFIX = 1 << 12
CHUNK_MARK = re.compile(rb"\x04\x00\x00\x00op=\x05")
LONGEST_CHUNK_HEADER = 80
COMPRESSIONS = (b"none", b"bz2", b"lz4")
OPS = (BAG, INDEX, CHUNK, CHUNK_INFO, CONNECTION)


@dataclass(frozen=True)
class Scan:
    """What a scan finds: connections, chunks in file order, and gaps."""

    channels: dict[int, Channel]
    spans: list[ChunkSpan]
    losses: list[Loss]


def scan_bag(source: Source) -> Scan:
    """Walk the records of a bag, and go on at the next chunk where one is broken.

    Every chunk is decompressed once, for the connections that only it may hold and for counts.
    """
    channels: dict[int, Channel] = {}
    spans: list[ChunkSpan] = []
    losses: list[Loss] = []
    for record in _top_records(source, spans, losses):
        if record.op == CONNECTION:
            data = source.read(record.data_offset, record.data_size)
            _note_connection(channels, record, data)
        elif record.op == INDEX and spans:
            spans[-1] = _with_count(source, spans[-1], record)
    counts: Counter[int] = Counter()
    for span in spans:
        counts.update(_note_chunk(source, span, channels))
    counted = {
        number: replace(channel, count=counts[number])
        for number, channel in sorted(channels.items())
    }
    return Scan(counted, spans, losses)


def _top_records(source: Source, spans: list[ChunkSpan], losses: list[Loss]) -> Iterator[Record]:
    """Yield the records outside chunks, and collect chunks and gaps on the way."""
    offset, resume, open_chunk = FIRST_RECORD, FIRST_RECORD, False
    while offset < source.size:
        record = _record_at(source, offset)
        if record is not None:
            stop = record.data_offset + record.data_size
            open_chunk = record.op == CHUNK
            resume = record.data_offset if open_chunk else offset + 1
            if open_chunk:
                spans.append(_span(record))
            if stop <= source.size:
                yield record
                offset = stop
                continue
        following = _next_chunk(source, resume)
        stop = source.size if following is None else following
        if open_chunk:
            spans[-1] = replace(spans[-1], size=max(0, stop - spans[-1].offset), cut=True)
        losses.append(_gap(source, offset, stop))
        offset, open_chunk = stop, False


def _gap(source: Source, start: int, stop: int) -> Loss:
    end = "its end" if stop == source.size else f"the chunk at byte {stop}"
    return Loss(f"{source.path.name}: broken or cut at byte {start}, read again from {end}")


def _record_at(source: Source, offset: int) -> Record | None:
    """The record at an offset of the file, with offsets of the file; None where none is."""
    try:
        record = parse_record(source.read(offset, PREFIX), 0)
        if record.op not in OPS or (record.op == CHUNK and not _is_chunk(record)):
            return None
    except ValueError:
        return None
    return record._replace(data_offset=offset + record.data_offset)


def _is_chunk(record: Record) -> bool:
    sound = record.fields.get(b"compression") in COMPRESSIONS
    return sound and len(record.fields.get(b"size", b"")) == 4  # noqa: PLR2004


def _next_chunk(source: Source, offset: int) -> int | None:
    """Find the next chunk header; its op may be any of its fields."""
    while (mark := source.search(CHUNK_MARK, offset)) is not None:
        for start in range(mark - 4, max(mark - LONGEST_CHUNK_HEADER, offset - 1), -1):
            size = int.from_bytes(source.read(start, 4), "little")
            if mark - start < size + 4 <= LONGEST_CHUNK_HEADER:
                record = _record_at(source, start)
                if record is not None and record.op == CHUNK:
                    return start
        offset = mark + 1
    return None


def _span(record: Record) -> ChunkSpan:
    compression = record.fields[b"compression"].decode()
    declared = u32(record.fields, b"size")
    return ChunkSpan(record.data_offset, record.data_size, compression, declared)


def _with_count(source: Source, span: ChunkSpan, record: Record) -> ChunkSpan:
    """Add count and end of an index record, which follows the chunk that it indexes.

    Its entries are the time, u32 seconds and u32 nanoseconds, and the offset in the chunk, u32.
    """
    try:
        number, count = u32(record.fields, b"conn"), u32(record.fields, b"count")
    except ValueError:
        return span
    if count * INDEX_ENTRY != record.data_size:
        return span
    last = source.read(record.data_offset + record.data_size - INDEX_ENTRY, TIME.size)
    seconds, nanoseconds = TIME.unpack(last) if len(last) == TIME.size else (0, 0)
    stop = max(span.stop_ns or 0, seconds * 1_000_000_000 + nanoseconds)
    return replace(span, counts={**span.counts, number: count}, stop_ns=stop)


def _note_connection(channels: dict[int, Channel], record: Record, data: bytes) -> None:
    """Keep the first definition of a connection; the rest of the file agrees with it or lies."""
    try:
        fields = parse_fields(data)
        number = u32(record.fields, b"conn")
        topic = (record.fields.get(b"topic") or fields[b"topic"]).decode()
        message_type = normalise_type(fields[b"type"].decode())
        definition = fields.get(b"message_definition", b"").decode()
    except (ValueError, KeyError):
        return
    channels.setdefault(number, Channel(topic, message_type, "ros1", definition))


def _note_chunk(source: Source, span: ChunkSpan, channels: dict[int, Channel]) -> Counter[int]:
    """Collect a chunk's connections, and count its messages."""
    content, _ = read_content(source, span)
    counts: Counter[int] = Counter()
    try:
        for record in walk_records(content):
            if record.op == CONNECTION:
                stop = record.data_offset + record.data_size
                _note_connection(channels, record, content[record.data_offset : stop])
            elif record.op == MESSAGE:
                counts[u32(record.fields, b"conn")] += 1
    except ValueError:
        pass
    return counts
