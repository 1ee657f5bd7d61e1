"""MCAP files without a usable summary: cut, without footer, unchunked, or damaged in the middle."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from io import BytesIO
from itertools import islice

from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode
from mcap.records import Statistics

from graspe_data.recordings.containers.chunks import ChunkSpan, read_content
from graspe_data.recordings.containers.mcap_records import (
    MAGIC,
    MESSAGE_HEAD,
    PREFIX,
    ChannelTable,
    McapRecord,
    chunk_span,
    walk_records,
)
from graspe_data.recordings.containers.salvage_places import SalvagePlaces, end_at
from graspe_data.recordings.containers.storage import Source
from graspe_data.recordings.containers.work_limit import WorkLimit
from graspe_data.recordings.messages import Damage

HEAD = 64
LOOSE_RUN = 4 << 20
INDEX_ENTRY = 16
MAXIMUM_DEFINITION = 1 << 20
LAST_OPCODE = int(Opcode.DATA_END)
LOOSE = (int(Opcode.SCHEMA), int(Opcode.CHANNEL), int(Opcode.MESSAGE))
# A chunk record: opcode, length below 2^40, two times, size below 2^40, checksum, compression.
CHUNK_MARK = re.compile(
    rb"\x06(?=.{5}\0{3}.{16}.{5}\0{3}.{4}"
    rb"(?:\x04\0\0\0zstd|\x03\0\0\0lz4|\0\0\0\0).{5}\0{3})",
    re.DOTALL,
)


@dataclass
class McapScan:
    """What a scan finds: channels, chunks and runs of loose messages in file order, and gaps."""

    table: ChannelTable = field(default_factory=ChannelTable)
    spans: list[ChunkSpan] = field(default_factory=list)
    losses: list[Damage] = field(default_factory=list)
    counts: Counter[int] = field(default_factory=Counter)
    expected: dict[int, int] = field(default_factory=dict)
    index_counts: dict[int, int] = field(default_factory=dict)
    """Those of the last chunk."""
    ended: bool = False


def scan_mcap(source: Source) -> McapScan:
    """Walk the records of a file, and go on at the next chunk where one is broken.

    Every chunk is decompressed once, for the channels that only it may define and for counts.
    """
    scan = McapScan()
    places = SalvagePlaces(source, lambda file: file.search_all(CHUNK_MARK))
    offset = resume = len(MAGIC)
    while offset < source.size and not scan.ended:
        record = _record_at(source, offset)
        if record is not None:
            _note(source, scan, record)
            resume = record.offset
            if record.offset + record.size <= source.size:
                offset = record.offset + record.size
                continue
        elif scan.spans and scan.spans[-1].offset > resume and places.is_sound(scan.spans[-1]):
            resume = offset
        following = places.next_chunk(resume)
        places.note_gap(offset, following)
        offset = source.size if following is None else following
        end_at(scan.spans, offset)
        resume = offset + 1
    scan.losses += places.losses
    if not scan.ended and not scan.losses:
        scan.losses.append(Damage(f"{source.path.name}: cut at byte {source.size}, without footer"))
    limit = WorkLimit(source.path, source.size)
    for span in scan.spans:
        _note_content(source, scan, span, limit)
    scan.losses += _unfound(source, scan)
    return scan


def _unfound(source: Source, scan: McapScan) -> Iterator[Damage]:
    """Messages that the statistics count and no chunk that was found accounts for."""
    indexed: Counter[int] = Counter()
    for span in scan.spans:
        indexed.update(span.counts)
    for number, count in sorted(scan.expected.items()):
        missing = count - max(scan.counts[number], indexed[number])
        if missing > 0:
            channel = scan.table.channels.get(number)
            reason = f"{source.path.name}: counted in its statistics, in no chunk that was found"
            yield Damage(reason, channel.topic if channel is not None else None, missing)


def _record_at(source: Source, offset: int) -> McapRecord | None:
    head = source.read(offset, PREFIX.size)
    if len(head) < PREFIX.size:
        return None
    opcode, size = PREFIX.unpack(head)
    sound = 0 < opcode <= LAST_OPCODE and size < 1 << 40
    return McapRecord(opcode, offset + PREFIX.size, size) if sound else None


def _note(source: Source, scan: McapScan, record: McapRecord) -> None:
    end = record.offset + record.size + len(MAGIC)
    scan.ended = record.opcode == Opcode.FOOTER and end == source.size
    available = min(record.size, source.size - record.offset)
    if record.opcode == Opcode.CHUNK:
        span = chunk_span(source.read(record.offset, HEAD), record.offset, available)
        if span is not None:
            scan.index_counts = {}
            scan.spans.append(replace(span, start_ns=None, counts=scan.index_counts))
    elif record.opcode == Opcode.MESSAGE_INDEX and scan.spans:
        _note_index(source, scan, record)
    elif record.opcode == Opcode.STATISTICS and available == record.size:
        _note_statistics(scan, source.read(record.offset, min(record.size, MAXIMUM_DEFINITION)))
    elif record.opcode in LOOSE and available == record.size:
        _note_loose(scan, record)


def _note_index(source: Source, scan: McapScan, record: McapRecord) -> None:
    """Take the count of an index record: channel u16, length u32, entries of 16 bytes."""
    head = source.read(record.offset, 6)
    channel, size = int.from_bytes(head[:2], "little"), int.from_bytes(head[2:], "little")
    if size + len(head) == record.size:
        scan.index_counts[channel] = size // INDEX_ENTRY


def _note_statistics(scan: McapScan, content: bytes) -> None:
    try:
        statistics = Statistics.read(ReadDataStream(BytesIO(content)))
    except Exception:  # noqa: BLE001 - struct, end of file: the record is broken
        return
    scan.expected = dict(statistics.channel_message_counts)


def _note_loose(scan: McapScan, record: McapRecord) -> None:
    """Join a record outside chunks to the run before it: it reads like a chunk not compressed."""
    start, stop = record.offset - PREFIX.size, record.offset + record.size
    last = scan.spans[-1] if scan.spans else None
    if last is not None and not last.crc and last.offset + last.size == start and _is_loose(last):
        scan.spans[-1] = replace(last, size=stop - last.offset, declared=stop - last.offset)
    else:
        scan.spans.append(ChunkSpan(start, stop - start, "", stop - start))


def _is_loose(span: ChunkSpan) -> bool:
    return span.stop_ns is None and span.size < LOOSE_RUN


def _note_content(source: Source, scan: McapScan, span: ChunkSpan, limit: WorkLimit) -> None:
    content, _ = read_content(source, span)
    records = 0
    walk = islice(walk_records(content), limit.records_left + 1)
    try:
        for opcode, offset, size in walk:
            records += 1
            if opcode == Opcode.MESSAGE and size >= MESSAGE_HEAD.size:
                scan.counts[int.from_bytes(content[offset : offset + 2], "little")] += 1
            elif opcode != Opcode.MESSAGE and size < MAXIMUM_DEFINITION:
                scan.table.note(opcode, content[offset : offset + size])
    except ValueError:
        pass
    limit.spend(len(content), records)
