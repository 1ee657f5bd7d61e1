"""When the messages of one file begin and end, without reading them."""

from __future__ import annotations

import sqlite3
import tempfile
from collections.abc import Iterable, Iterator, Mapping
from contextlib import closing
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from urllib.parse import quote

from mcap.opcode import Opcode

from graspe_data.recordings.containers.chunks import ChunkSpan, read_content
from graspe_data.recordings.containers.decompression import ZSTD_MAGIC, decompress_file
from graspe_data.recordings.containers.mcap_records import (
    CHUNK_HEAD,
    MAGIC,
    MESSAGE_HEAD,
    PREFIX,
)
from graspe_data.recordings.containers.mcap_storage import read_summary
from graspe_data.recordings.containers.rosbag1_records import (
    CHUNK,
    MAXIMUM_HEADER,
    parse_record,
    u32,
    walk_messages,
)
from graspe_data.recordings.containers.rosbag1_storage import read_index
from graspe_data.recordings.containers.storage import Source
from graspe_data.recordings.message_types import normalise_type

FIRST_BAG_RECORD = 13
AFTER_THE_LAST = 1
"""rosbags gives as a chunk's end the nanosecond after its last message."""
RECORDS_BEFORE_A_CHUNK = 1000
STEPS_PER_CALL = 1 << 16
CALLS_PER_MEGABYTE = 1000
TYPES = "SELECT name, type FROM topics"
TIMES = "SELECT min(timestamp), max(timestamp) FROM messages"
KEPT = 4096


@dataclass(frozen=True)
class Ends:
    """The first and last bag time of a file's messages, int64 ns, and the types of its topics.

    A time is None where nothing sound says it: a file that was cut has no known end. ``empty`` is
    a file that is whole and holds no message.
    """

    start_ns: int | None = None
    stop_ns: int | None = None
    empty: bool = False
    types: Mapping[str, str] = field(default_factory=dict)


def read_ends(path: Path) -> Ends:
    """Read the ends of a storage file by its index; of a damaged one what its beginning says.

    Nothing is raised: of a file that cannot be read nothing is known. A file that was compressed as
    a whole is decompressed for this, once as long as it does not change.
    """
    try:
        state = path.stat()
    except OSError:
        return Ends()
    return _read_once(path.absolute(), state.st_mtime_ns, state.st_size)


@lru_cache(maxsize=KEPT)
def _read_once(path: Path, _modified_ns: int, _size: int) -> Ends:
    try:
        with path.open("rb") as file:
            magic = file.read(16)
        if not magic.startswith(ZSTD_MAGIC):
            return _read(path, magic)
        with tempfile.TemporaryDirectory(prefix="graspe-") as folder:
            plain = Path(folder) / path.name.removesuffix(".zstd")
            fault = decompress_file(path, plain)
            with plain.open("rb") as file:
                ends = _read(plain, file.read(16))
            return Ends(ends.start_ns, None, types=ends.types) if fault else ends
    except Exception:  # noqa: BLE001 - whatever a broken file leads to, its ends are unknown
        return Ends()


def _read(path: Path, magic: bytes) -> Ends:
    if magic.startswith(b"SQLite"):
        return _sqlite_ends(path)
    with closing(Source(path)) as source:
        return _mcap_ends(source) if magic.startswith(MAGIC) else _bag_ends(source)


def _bag_ends(source: Source) -> Ends:
    try:
        channels, spans = read_index(source)
    except Exception:  # noqa: BLE001 - a bag that was never closed, or is damaged
        return Ends(start_ns=_first_of_bag(source))
    start, stop = _spanned(span for span in spans if span.counts)
    types = {channel.topic: channel.message_type for channel in channels.values()}
    last = None if stop is None else stop - AFTER_THE_LAST
    return Ends(start, last, empty=start is None, types=types)


def _first_of_bag(source: Source) -> int | None:
    """The first time of the first chunk."""
    offset = FIRST_BAG_RECORD
    for _ in range(RECORDS_BEFORE_A_CHUNK):
        record = parse_record(source.read(offset, MAXIMUM_HEADER), 0)
        start = offset + record.data_offset
        if record.op == CHUNK:
            compression, size = record.fields[b"compression"].decode(), u32(record.fields, b"size")
            span = ChunkSpan(start, record.data_size, compression, size, cut=True)
            return min(_times(read_content(source, span)[0]), default=None)
        offset = start + record.data_size
    return None


def _times(content: bytes) -> Iterator[int]:
    try:
        for _, time_ns, _ in walk_messages(content):
            yield time_ns
    except ValueError:
        return


def _mcap_ends(source: Source) -> Ends:
    try:
        channels, spans = read_summary(source)
    except Exception:  # noqa: BLE001 - no summary, or a broken one
        return _walked_mcap(source)
    times = _spanned(span for span in spans if span.counts)
    types = {channel.topic: channel.message_type for channel in channels.values()}
    return Ends(*times, empty=times == (None, None), types=types)


def _walked_mcap(source: Source) -> Ends:
    """By the heads of chunks and messages, from record to record; no end where it is cut."""
    start_ns: int | None = None
    stop_ns: int | None = None
    whole = False
    for opcode, size, head in _heads(source):
        whole = opcode in (Opcode.DATA_END, Opcode.FOOTER)
        if opcode == Opcode.CHUNK and size >= CHUNK_HEAD.size:
            first, last, *_ = CHUNK_HEAD.unpack_from(head)
        elif opcode == Opcode.MESSAGE and size >= MESSAGE_HEAD.size:
            first = last = MESSAGE_HEAD.unpack_from(head)[2]
        else:
            continue
        start_ns = first if start_ns is None else min(first, start_ns)
        stop_ns = last if stop_ns is None else max(last, stop_ns)
    return Ends(start_ns, stop_ns if whole else None, empty=whole and start_ns is None)


def _heads(source: Source) -> Iterator[tuple[int, int, bytes]]:
    """The opcode, size and first bytes of each whole record, up to the end of the data."""
    offset = len(MAGIC)
    while len(head := source.read(offset, PREFIX.size + CHUNK_HEAD.size)) >= PREFIX.size:
        opcode, size = PREFIX.unpack_from(head)
        offset += PREFIX.size + size
        if offset > source.size:
            return
        yield opcode, size, head[PREFIX.size :]
        if opcode in (Opcode.DATA_END, Opcode.FOOTER):
            return


def _spanned(spans: Iterable[ChunkSpan]) -> tuple[int | None, int | None]:
    known = [(span.start_ns, span.stop_ns) for span in spans]
    starts = [start for start, _ in known if start is not None]
    stops = [stop for _, stop in known if stop is not None]
    return min(starts, default=None), max(stops, default=None)


def _sqlite_ends(path: Path) -> Ends:
    """By the time index. What waits in a write-ahead log beside the file is not looked at."""
    uri = f"file:{quote(str(path.resolve()))}?mode=ro&immutable=1"
    calls = iter(range(2 + CALLS_PER_MEGABYTE * (1 + (path.stat().st_size >> 20))))
    log = path.with_name(f"{path.name}-wal")
    waiting = log.is_file() and log.stat().st_size > 0
    with closing(sqlite3.connect(uri, uri=True)) as database:
        database.execute("PRAGMA trusted_schema = OFF")
        database.set_progress_handler(lambda: next(calls, None) is None, STEPS_PER_CALL)
        types = {str(name): normalise_type(str(kind)) for name, kind in database.execute(TYPES)}
        start, stop = database.execute(TIMES).fetchone()
    if not isinstance(start, int) or not isinstance(stop, int):
        return Ends(empty=start is None and not waiting, types=types)
    return Ends(start, None if waiting else stop, types=types)
