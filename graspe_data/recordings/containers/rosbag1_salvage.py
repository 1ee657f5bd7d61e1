"""Bags without a usable index: cut, unindexed, ``.bag.active``, or damaged in the middle."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import islice

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
from graspe_data.recordings.containers.salvage_places import SalvagePlaces, end_at
from graspe_data.recordings.containers.storage import Channel, Source
from graspe_data.recordings.containers.work_limit import WorkLimit
from graspe_data.recordings.message_types import normalise_type
from graspe_data.recordings.messages import Damage

FIRST_RECORD = 13
INDEX_ENTRY = 12
PREFIX = 1 << 12
CHUNK_MARK = re.compile(rb"\x04\x00\x00\x00op=\x05")
LONGEST_CHUNK_HEADER = 80
SMALL_SIZE = re.compile(rb"(?=[\x00-\x50]\0\0\0)", re.DOTALL)
COMPRESSIONS = (b"none", b"bz2", b"lz4")
OPS = (BAG, INDEX, CHUNK, CHUNK_INFO, CONNECTION)


@dataclass(frozen=True)
class Scan:
    """What a scan finds: connections, chunks in file order, and gaps."""

    channels: dict[int, Channel]
    spans: list[ChunkSpan]
    losses: list[Damage]


def scan_bag(source: Source) -> Scan:
    """Walk the records of a bag, and go on at the next chunk where one is broken.

    Every chunk is decompressed once, for the connections that only it may hold and for counts.
    """
    channels: dict[int, Channel] = {}
    spans: list[ChunkSpan] = []
    places = SalvagePlaces(source, _chunks)
    index_counts: dict[int, int] = {}
    for record in _top_records(source, spans, places):
        if record.op == CONNECTION:
            data = source.read(record.data_offset, record.data_size)
            _note_connection(channels, record, data)
        elif record.op == CHUNK:
            index_counts = {}
            spans[-1] = replace(spans[-1], counts=index_counts)
        elif record.op == INDEX and spans:
            spans[-1] = _with_count(source, spans[-1], index_counts, record)
    counts: Counter[int] = Counter()
    limit = WorkLimit(source.path, source.size)
    for span in spans:
        _note_chunk(source, span, channels, counts, limit)
    counted = {
        number: replace(channel, count=counts[number])
        for number, channel in sorted(channels.items())
    }
    return Scan(counted, spans, places.losses)


def _top_records(source: Source, spans: list[ChunkSpan], places: SalvagePlaces) -> Iterator[Record]:
    """Yield the records outside chunks, and collect chunks and gaps on the way."""
    offset, resume, after_chunk = FIRST_RECORD, FIRST_RECORD, False
    while offset < source.size:
        record = _record_at(source, offset)
        if record is not None:
            after_chunk = record.op == CHUNK
            resume = record.data_offset if after_chunk else offset + 1
            if after_chunk:
                spans.append(_span(record))
            if record.data_offset + record.data_size <= source.size:
                yield record
                offset = record.data_offset + record.data_size
                continue
        elif after_chunk and places.is_sound(spans[-1]):
            resume = offset
        following = places.next_chunk(resume)
        places.note_gap(offset, following)
        offset, after_chunk = source.size if following is None else following, False
        end_at(spans, offset)


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


def _chunks(source: Source) -> Iterator[int]:
    """Find all chunk headers; the op may be any of their fields."""
    for mark in source.search_all(CHUNK_MARK):
        first = max(0, mark - LONGEST_CHUNK_HEADER)
        before = source.read(first, mark - first)
        for start in reversed([match.start() for match in SMALL_SIZE.finditer(before)]):
            size = before[start]
            if len(before) - start < size + 4 <= LONGEST_CHUNK_HEADER:
                record = _record_at(source, first + start)
                if record is not None and record.op == CHUNK:
                    yield first + start
                    break


def _span(record: Record) -> ChunkSpan:
    compression = record.fields[b"compression"].decode()
    declared = u32(record.fields, b"size")
    return ChunkSpan(record.data_offset, record.data_size, compression, declared)


def _with_count(
    source: Source, span: ChunkSpan, counts: dict[int, int], record: Record
) -> ChunkSpan:
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
    counts[number] = count
    return replace(span, stop_ns=stop)


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


def _note_chunk(
    source: Source,
    span: ChunkSpan,
    channels: dict[int, Channel],
    counts: Counter[int],
    limit: WorkLimit,
) -> None:
    """Collect a chunk's connections, and count its messages."""
    content, _ = read_content(source, span)
    records = 0
    try:
        for record in islice(walk_records(content), limit.records_left + 1):
            records += 1
            if record.op == CONNECTION:
                stop = record.data_offset + record.data_size
                _note_connection(channels, record, content[record.data_offset : stop])
            elif record.op == MESSAGE:
                counts[u32(record.fields, b"conn")] += 1
    except ValueError:
        pass
    limit.spend(len(content), records)
