"""MCAP files: by their summary where it is sound, else by what a scan of the file finds."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from io import BytesIO

from mcap.records import Channel as McapChannel
from mcap.records import ChunkIndex, Schema, Statistics
from mcap.stream_reader import StreamReader

from graspe_data.errors import RecordingError
from graspe_data.recordings.containers.chunked_storage import ChunkedStorage
from graspe_data.recordings.containers.chunks import ChunkSpan, overlapping
from graspe_data.recordings.containers.mcap_records import (
    MAGIC,
    PREFIX,
    ChannelTable,
    chunk_span,
    walk_messages,
)
from graspe_data.recordings.containers.mcap_salvage import scan_mcap
from graspe_data.recordings.containers.storage import Channel, Source
from graspe_data.recordings.messages import Damage

FOOTER = 9 + 20 + len(MAGIC)
MAXIMUM_SUMMARY = 256 << 20
INDEX_HEAD = 15
INDEX_ENTRY = 16
CHUNK_HEADER = 64


@dataclass
class _Summary:
    table: ChannelTable = field(default_factory=ChannelTable)
    chunks: list[ChunkIndex] = field(default_factory=list)
    statistics: Statistics | None = None


class McapStorage(ChunkedStorage):
    """One ``.mcap`` file."""

    walk = staticmethod(walk_messages)

    def _open(self) -> None:
        try:
            self.channels, self._spans = read_summary(self._source)
        except RecordingError:
            raise
        except Exception as error:  # noqa: BLE001 - whatever a broken summary leads to
            found = scan_mcap(self._source)
            self._spans = found.spans
            self.channels = {
                number: replace(channel, count=found.counts[number])
                for number, channel in sorted(found.table.channels.items())
            }
            if found.losses:
                reason = f"{self._source.path.name}: no usable summary ({error}); read by scanning"
                self.losses = [Damage(reason), *found.losses]


def read_summary(source: Source) -> tuple[dict[int, Channel], list[ChunkSpan]]:
    """Channels and chunks by the summary; any exception where it is not sound or absent."""
    summary = _parse_summary(source)
    statistics = summary.statistics
    if not summary.chunks and (statistics is None or statistics.message_count > 0):
        raise ValueError("the summary lists no chunks")
    spans = [_indexed_span(source, index) for index in summary.chunks]
    if overlapping(spans):
        raise ValueError("the summary lists chunks that claim the same bytes")
    counts = dict(statistics.channel_message_counts) if statistics is not None else {}
    used = {channel for span in spans for channel in span.counts}
    if missing := used - summary.table.channels.keys():
        raise ValueError(f"the summary does not define the channels {sorted(missing)[:5]}")
    channels = {
        number: replace(channel, count=counts.get(number, 0) if counts else None)
        for number, channel in summary.table.channels.items()
    }
    return channels, spans


def _parse_summary(source: Source) -> _Summary:
    footer = source.read(source.size - FOOTER, FOOTER)
    if len(footer) < FOOTER or not footer.endswith(MAGIC) or PREFIX.unpack_from(footer) != (2, 20):
        raise ValueError("there is no footer")
    start = int.from_bytes(footer[9:17], "little")
    size = source.size - start
    if start == 0:
        raise ValueError("there is no summary")
    if not FOOTER <= size <= MAXIMUM_SUMMARY:
        raise ValueError(f"the footer points to byte {start} of {source.size}")
    content = BytesIO(source.read(start, size))
    summary = _Summary()
    for record in StreamReader(content, skip_magic=True, record_size_limit=size).records:
        if isinstance(record, Schema):
            summary.table.add_schema(record)
        elif isinstance(record, McapChannel):
            summary.table.add_channel(record)
        elif isinstance(record, ChunkIndex):
            summary.chunks.append(record)
        elif isinstance(record, Statistics):
            summary.statistics = record
    return summary


def _indexed_span(source: Source, index: ChunkIndex) -> ChunkSpan:
    start = index.chunk_start_offset + PREFIX.size
    size = index.chunk_length - PREFIX.size
    span = chunk_span(source.read(start, CHUNK_HEADER), start, size)
    if span is None or not 0 < start + size <= source.size:
        raise ValueError(f"there is no chunk at byte {index.chunk_start_offset}")
    return replace(
        span,
        start_ns=index.message_start_time,
        stop_ns=index.message_end_time,
        counts=_index_counts(index),
    )


def _index_counts(index: ChunkIndex) -> dict[int, int]:
    """Messages a channel, by the distance between its index record and the next."""
    offsets = sorted((offset, channel) for channel, offset in index.message_index_offsets.items())
    end = index.chunk_start_offset + index.chunk_length + index.message_index_length
    stops = [offset for offset, _ in offsets[1:]] + [end]
    return {
        channel: max(0, stop - offset - INDEX_HEAD) // INDEX_ENTRY
        for (offset, channel), stop in zip(offsets, stops, strict=True)
    }
