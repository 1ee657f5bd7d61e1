"""Messages out of chunks: bounded, in time order where the index gives times."""

from __future__ import annotations

import zlib
from bisect import bisect_right
from collections import Counter
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import islice, pairwise

from graspe_data.recordings.containers.decompression import MAXIMUM_SIZE, decompress
from graspe_data.recordings.containers.storage import MAXIMUM_TIME, Channel, Source
from graspe_data.recordings.containers.work_limit import WorkLimit
from graspe_data.recordings.messages import Damage, RawMessage

PENDING = 256 << 20
MAXIMUM_LOSSES = 1000

Walk = Callable[[bytes], Iterator[tuple[int, int, memoryview]]]
"""From a chunk's content to (channel, time in ns, data); ValueError at the first broken record."""


@dataclass(frozen=True)
class ChunkSpan:
    """Where a chunk lies in its file, and what the file says about it."""

    offset: int
    size: int
    compression: str
    declared: int
    crc: int = 0
    start_ns: int | None = None
    stop_ns: int | None = None
    counts: Mapping[int, int] = field(default_factory=dict)
    cut: bool = False
    """Whether the file ends in it, so that its beginning is sound and the rest is missing."""


class ChunkReader:
    """Reads the messages of the chunks of one file."""

    def __init__(
        self, source: Source, channels: Mapping[int, Channel], walk: Walk, first_position: int = 0
    ) -> None:
        """Read from a file, by its channels and the walk of its format; one pass."""
        self.source = source
        self.channels = channels
        self.walk = walk
        self.first_position = first_position
        self.limit = WorkLimit(source.path, source.size)
        self._positions: dict[int, int] = {}
        self._noted = 0
        self._together: dict[str | None, int] = {}

    def messages(
        self, spans: Sequence[ChunkSpan], wanted: Collection[int], losses: list[Damage]
    ) -> Iterator[RawMessage]:
        """Yield messages chunk by chunk, merged by time where chunks carry times.

        Chunks that overlap in time are merged; no more than 256 MiB wait for that, then order
        gives way to memory.
        """
        self._positions = first_positions(spans, self.first_position)
        if any(span.start_ns is None for span in spans):
            for span in spans:
                yield from self._read(span, wanted, losses)
            return
        ordered = sorted(spans, key=lambda span: (span.start_ns or 0, span.offset))
        following_starts = [*(span.start_ns or 0 for span in ordered), MAXIMUM_TIME][1:]
        waiting: list[RawMessage] = []
        for span, following in zip(ordered, following_starts, strict=True):
            if not span.counts or any(channel in wanted for channel in span.counts):
                waiting += self._read(span, wanted, losses)
            waiting.sort(key=_time)
            cut = bisect_right(waiting, following, key=_time)
            if sum(len(message.data) for message in waiting[cut:]) > PENDING:
                cut = len(waiting)
            yield from waiting[:cut]
            del waiting[:cut]

    def _read(
        self, span: ChunkSpan, wanted: Collection[int], losses: list[Damage]
    ) -> list[RawMessage]:
        content, fault = read_content(self.source, span)
        messages: list[RawMessage] = []
        seen: Counter[int] = Counter()
        unknown: Counter[str] = Counter()
        position = first = self._positions[span.offset]
        walk = islice(self.walk(content), self.limit.records_left + 1)
        try:
            for position, (channel, time_ns, data) in enumerate(walk, first + 1):
                known = self.channels.get(channel)
                if known is None or time_ns > MAXIMUM_TIME:
                    unknown[
                        "a channel that is defined nowhere" if known is None else "no time"
                    ] += 1
                    continue
                seen[channel] += 1
                if channel in wanted:
                    messages.append(RawMessage(known.topic, time_ns, data, position))
        except ValueError as error:
            fault = fault or str(error)
        self.limit.spend(len(content), position - first)
        self._note(losses, self._losses(span, fault, seen, messages))
        self._note(
            losses,
            [
                Damage(f"{self._where(span)} has messages of {what}", None, count)
                for what, count in sorted(unknown.items())
            ],
        )
        return messages

    def _note(self, losses: list[Damage], found: Sequence[Damage]) -> None:
        """Add losses; beyond a thousand, those of a topic are counted together."""
        for loss in found:
            place = self._together.get(loss.topic)
            if self._noted < MAXIMUM_LOSSES:
                losses.append(loss)
            elif place is None:
                self._together[loss.topic] = len(losses)
                losses.append(replace(loss, reason=f"{loss.reason}, and more such chunks"))
            else:
                count = (losses[place].messages or 0) + (loss.messages or 0)
                losses[place] = replace(losses[place], messages=count or None)
            self._noted += 1

    def _losses(
        self,
        span: ChunkSpan,
        fault: str | None,
        seen: Mapping[int, int],
        messages: Sequence[RawMessage],
    ) -> list[Damage]:
        missing = {
            channel: count - seen.get(channel, 0)
            for channel, count in sorted(span.counts.items())
            if channel in self.channels and count > seen.get(channel, 0)
        }
        if fault is None and not missing:
            return []
        reason = f"{self._where(span)} {fault or 'holds fewer messages than its index says'}"
        if not missing:
            return [Damage(reason)]
        last = max((message.bag_time_ns for message in messages), default=span.start_ns)
        seconds = None
        if last is not None and span.stop_ns is not None:
            seconds = max(0, span.stop_ns - last) / 1e9
        return [
            Damage(reason, self.channels[channel].topic, count, seconds)
            for channel, count in missing.items()
        ]

    def _where(self, span: ChunkSpan) -> str:
        return f"{self.source.path.name}: the chunk at byte {span.offset}"


def first_positions(spans: Sequence[ChunkSpan], first: int) -> dict[int, int]:
    """What the positions of a chunk's messages begin after, by the chunk's offset.

    A chunk gets as many as it could have messages: one a byte of its content.
    """
    positions = {}
    for span in sorted(spans, key=lambda span: span.offset):
        positions[span.offset] = first
        first += positions_of(span)
    return positions


def positions_of(span: ChunkSpan) -> int:
    """How many positions a chunk gets."""
    return min(span.declared, MAXIMUM_SIZE)


def overlapping(spans: Sequence[ChunkSpan]) -> bool:
    """Whether two chunks claim the same bytes of the file."""
    ordered = sorted(spans, key=lambda span: span.offset)
    return any(before.offset + before.size > span.offset for before, span in pairwise(ordered))


def read_content(source: Source, span: ChunkSpan) -> tuple[bytes, str | None]:
    """Read and decompress a chunk: as much as is sound, and what is wrong with it or None.

    A compressed chunk that is whole and does not give its declared size is damaged somewhere, so
    nothing of it is taken; of one that is cut, what is there.
    """
    data = source.read(span.offset, min(span.size, MAXIMUM_SIZE))
    content, fault = decompress(data, span.compression, span.declared)
    if fault is None and span.crc and zlib.crc32(content) != span.crc:
        return b"", "does not match its checksum, so its messages are left out"
    if fault is not None and span.compression not in ("", "none") and not span.cut:
        return b"", fault
    return content, fault


def _time(message: RawMessage) -> int:
    return message.bag_time_ns
