"""Where a salvage goes on after damage: at the next chunk, found in one pass over the file."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Callable, Iterable
from dataclasses import replace

from graspe_data.recordings.containers.chunks import ChunkSpan, read_content
from graspe_data.recordings.containers.storage import Source
from graspe_data.recordings.messages import Damage

MAXIMUM_GAPS = 100
CHECKS_PER_BYTE = 4


class SalvagePlaces:
    """The places of a file where chunks begin, and the gaps between what was read.

    Args:
        source: The file.
        find: All places that look like the beginning of a chunk, in rising order.
    """

    def __init__(self, source: Source, find: Callable[[Source], Iterable[int]]) -> None:
        """Begin without a look; the file is searched once, where there is damage."""
        self._source = source
        self._find = find
        self._places: list[int] | None = None
        self._to_check = CHECKS_PER_BYTE * source.size
        self._gaps = 0
        self.losses: list[Damage] = []

    def next_chunk(self, offset: int) -> int | None:
        """The first place at or after an offset."""
        if self._places is None:
            self._places = sorted(self._find(self._source))
        at = bisect_left(self._places, offset)
        return self._places[at] if at < len(self._places) else None

    def is_sound(self, span: ChunkSpan) -> bool:
        """Whether a chunk's own checksum or compression says that it is whole.

        Four times the file is read for that at most; then every answer is no.
        """
        self._to_check -= span.size
        if self._to_check < 0 or not (span.crc or span.compression not in ("", "none")):
            return False
        return read_content(self._source, span)[1] is None

    def note_gap(self, start: int, stop: int | None) -> None:
        """Note that nothing was read between two places; None where nothing follows."""
        end = "its end" if stop is None else f"the chunk at byte {stop}"
        self._gaps += 1
        reason = f"{self._source.path.name}: broken or cut at byte {start}, read again from {end}"
        if self._gaps <= MAXIMUM_GAPS:
            self.losses.append(Damage(reason))
        else:
            more = f"{self._gaps - MAXIMUM_GAPS} more such places, the last at byte {start}"
            self.losses[MAXIMUM_GAPS:] = [Damage(f"{self._source.path.name}: {more}")]


def end_at(spans: list[ChunkSpan], stop: int) -> None:
    """Let the last chunk end where the next begins, whatever size it claims."""
    if spans and spans[-1].offset + spans[-1].size > stop:
        size = max(0, stop - spans[-1].offset)
        spans[-1] = replace(spans[-1], size=size, cut=True)
