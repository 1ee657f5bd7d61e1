"""Files that claim more than they hold: the work is in proportion to their bytes.

Work is counted, not timed: bytes read from the file, records walked, rows asked for.
"""

from __future__ import annotations

import sqlite3
import struct
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
import zstandard
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from graspe_data.errors import RecordingError
from graspe_data.recordings import open_recording
from graspe_data.recordings.containers import sqlite_storage
from graspe_data.recordings.containers.storage import Source

MCAP_MAGIC = b"\x89MCAP0\r\n"
BAG_START = b"#ROSBAG V2.0\n"
READS = 40
"""Most times that a byte of a file is read, all passes together; small reads overlap windows."""


@contextmanager
def _counted(monkeypatch: pytest.MonkeyPatch) -> Iterator[Callable[[], int]]:
    total = 0
    read = Source.read

    def counting(self: Source, offset: int, size: int) -> bytes:
        nonlocal total
        found = read(self, offset, size)
        total += len(found)
        return found

    monkeypatch.setattr(Source, "read", counting)
    yield lambda: total
    monkeypatch.setattr(Source, "read", read)


def _mcap_chunk(size: int, compression: bytes = b"", declared: int | None = None) -> bytes:
    """A chunk record that claims ``size`` bytes of content."""
    body = struct.pack("<QQQII", 0, 9, size if declared is None else declared, 0, len(compression))
    body += compression + struct.pack("<Q", size)
    return struct.pack("<BQ", 6, len(body) + size) + body


def _bag_record(op: int, fields: dict[str, bytes], size: int) -> bytes:
    items = {"op": bytes([op]), **fields}
    header = b"".join(
        struct.pack("<I", len(name) + 1 + len(value)) + name.encode() + b"=" + value
        for name, value in items.items()
    )
    return struct.pack("<I", len(header)) + header + struct.pack("<I", size)


def _bag_chunk(size: int, compression: bytes = b"none", declared: int | None = None) -> bytes:
    said = struct.pack("<I", size if declared is None else declared)
    return _bag_record(5, {"compression": compression, "size": said}, size)


def _nested(heads: list[bytes], start: bytes, size_of: Callable[[int], bytes]) -> bytes:
    """Chunks, each of which claims all that follows it up to a broken end."""
    count, head = len(heads), len(heads[0])
    body = b"".join(size_of(head * (count - number - 1)) for number in range(count))
    return start + body + b"\xff" * 64


def _read(path: Path) -> int:
    try:
        with open_recording(path) as recording:
            found = len(list(recording.messages()))
            list(recording.losses)
    except RecordingError as error:
        assert path.name in str(error)  # noqa: PT017
        return 0
    return found


@pytest.mark.parametrize("count", [200, 2000])
@pytest.mark.parametrize("suffix", [".mcap", ".bag"])
@pytest.mark.parametrize("past_the_end", [0, 10**6])
def test_chunks_that_claim_to_hold_one_another_are_read_a_few_times(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, suffix: str, count: int, past_the_end: int
) -> None:
    make = _mcap_chunk if suffix == ".mcap" else _bag_chunk
    start = MCAP_MAGIC if suffix == ".mcap" else BAG_START
    content = _nested([make(0)] * count, start, lambda size: make(size + past_the_end))
    path = tmp_path / f"a{suffix}"
    path.write_bytes(content)
    with _counted(monkeypatch) as read:
        _read(path)
    record = 0 if suffix == ".mcap" else 2 * 4096 * count
    assert read() < READS * len(content) + record + (4 << 20)


def test_an_index_whose_chunks_overlap_is_not_believed(
    tmp_path: Path, write: Any, single: Any, read: Any
) -> None:
    from mcap.reader import make_reader  # noqa: PLC0415

    path = single(write("mcap"))
    whole = read(path)
    with path.open("rb") as file:
        summary = make_reader(file).get_summary()
    assert summary is not None
    offsets = [index.chunk_start_offset for index in summary.chunk_indexes]
    content = bytearray(path.read_bytes())
    second = content.rindex(struct.pack("<Q", offsets[1]), len(content) // 2)
    content[second : second + 8] = struct.pack("<Q", offsets[0])
    path.write_bytes(content)
    assert sorted(read(path)) == sorted(whole)


def test_a_sound_chunk_that_looks_like_chunks_inside_keeps_its_messages(tmp_path: Path) -> None:
    from mcap.writer import CompressionType, Writer  # noqa: PLC0415

    path = tmp_path / "a.mcap"
    with path.open("wb") as file:
        writer = Writer(file, chunk_size=1 << 20, compression=CompressionType.NONE)
        writer.start()
        channel = writer.register_channel("/x", "cdr", writer.register_schema("a/B", "", b""))
        for number in range(20):
            writer.add_message(channel, number, _mcap_chunk(100), number)
        writer.finish()  # type: ignore[no-untyped-call]
    content = path.read_bytes()
    size = struct.unpack_from("<Q", content, content.index(b"\x06", 8) + 1)[0]
    path.write_bytes(content[: content.index(b"\x06", 8) + 9 + size] + b"\xff" * 40)
    with open_recording(path) as recording:
        assert len(list(recording.messages())) == 20


@pytest.mark.parametrize("records", ["empty", "messages"])
def test_content_of_endless_small_records_is_refused_by_name(tmp_path: Path, records: str) -> None:
    one = struct.pack("<BQ", 9, 0)
    if records == "messages":
        one = struct.pack("<BQHIQQ", 5, 22, 1, 0, 0, 0)
    content = one * ((48 << 20) // len(one))
    packed = zstandard.compress(content)
    chunk = _mcap_chunk(len(packed), b"zstd", len(content)) + packed
    channel = struct.pack("<HHI", 1, 0, 2) + b"/x" + struct.pack("<I", 3) + b"cdr" + bytes(4)
    record = struct.pack("<BQ", 4, len(channel)) + channel
    path = tmp_path / "a.mcap"
    path.write_bytes(MCAP_MAGIC + record + chunk * 3)
    assert path.stat().st_size < 1 << 20
    if records == "empty":
        assert _read(path) == 0
        return
    with pytest.raises(RecordingError, match=r"a\.mcap: .* more records than they can"):
        open_recording(path)


@pytest.mark.parametrize("suffix", [".mcap", ".bag"])
def test_many_small_bombs_are_refused_by_name(tmp_path: Path, suffix: str) -> None:
    import bz2  # noqa: PLC0415

    content = bytes(60 << 20)
    if suffix == ".mcap":
        packed = zstandard.compress(content)
        chunk, start = _mcap_chunk(len(packed), b"zstd", len(content)) + packed, MCAP_MAGIC
    else:
        packed = bz2.compress(content)
        chunk, start = _bag_chunk(len(packed), b"bz2", len(content)) + packed, BAG_START
    path = tmp_path / f"a{suffix}"
    path.write_bytes(start + chunk * 30)
    with pytest.raises(RecordingError, match="claim to hold more bytes of content"):
        open_recording(path)


@settings(max_examples=25, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    st.lists(
        st.one_of(
            st.integers(0, 4000).map(_mcap_chunk),
            st.integers(0, 4000).map(_bag_chunk),
            st.binary(max_size=200),
            st.just(struct.pack("<BQ", 7, 30) + bytes(30)),
        ),
        min_size=1,
        max_size=120,
    ),
    st.sampled_from([(".mcap", MCAP_MAGIC), (".bag", BAG_START)]),
)
def test_any_pile_of_claims_is_read_a_few_times(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    pile: list[bytes],
    kind: tuple[str, bytes],
) -> None:
    path = tmp_path / f"a{kind[0]}"
    path.write_bytes(kind[1] + b"".join(pile))
    with _counted(monkeypatch) as read:
        _read(path)
    assert read() < READS * path.stat().st_size + 2 * 4096 * len(pile) + (1 << 20)


TOPICS = (
    "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT, type TEXT, serialization_format TEXT)"
)
HOSTILE_SCHEMAS = {
    "generated": "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp"
    " INTEGER, data BLOB AS (zeroblob(900000000)))",
    "stored": "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp"
    " INTEGER AS (topic_id + 1) STORED, data BLOB)",
    "view": "CREATE VIEW messages AS WITH RECURSIVE c(n) AS (SELECT 1 UNION ALL SELECT n + 1 FROM"
    " c) SELECT n AS id, 1 AS topic_id, n AS timestamp, x'00' AS data FROM c",
    "virtual": "CREATE VIRTUAL TABLE messages USING fts5(id, topic_id, timestamp, data)",
    "hidden number": "CREATE TABLE messages(id INTEGER, topic_id INTEGER, timestamp INTEGER,"
    " data BLOB, rowid TEXT)",
}


@pytest.mark.parametrize("name", HOSTILE_SCHEMAS)
def test_only_plain_tables_with_plain_columns_are_read(tmp_path: Path, name: str) -> None:
    path = tmp_path / "a.db3"
    with sqlite3.connect(path) as database:
        database.execute(TOPICS)
        database.execute("INSERT INTO topics VALUES (1, '/x', 'std_msgs/msg/String', 'cdr')")
        database.execute(HOSTILE_SCHEMAS[name])
        if name == "generated":
            database.executemany(
                "INSERT INTO messages(topic_id, timestamp) VALUES (1, ?)",
                [(number,) for number in range(200)],
            )
    database.close()
    with pytest.raises(RecordingError, match=r"a\.db3: .*(plain tables)"):
        open_recording(path)


def test_rows_without_a_key_of_their_own_are_found_by_the_row_number(tmp_path: Path) -> None:
    path = tmp_path / "a.db3"
    with sqlite3.connect(path) as database:
        database.execute(TOPICS)
        database.execute("INSERT INTO topics VALUES (1, '/x', 'std_msgs/msg/String', 'cdr')")
        database.execute("CREATE TABLE messages(id, topic_id, timestamp, data)")
        database.executemany(
            "INSERT INTO messages VALUES (7, 1, ?, x'00')", [(number,) for number in range(5000)]
        )
    database.close()
    assert _read(path) == 5000


def test_rows_that_give_more_bytes_than_the_file_are_refused(
    write: Any, single: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As rows do whose pages are shared: here the file passes for a smaller one."""
    path = single(write("db3"))
    with open_recording(path) as recording:
        size = sum(len(raw.data) for raw in recording.messages())
        monkeypatch.setattr(sqlite_storage, "SHORTEST_LIMIT", size - path.stat().st_size - 1)
        with pytest.raises(RecordingError, match="rows share their pages"):
            list(recording.messages())
        monkeypatch.setattr(sqlite_storage, "SHORTEST_LIMIT", size - path.stat().st_size)
        assert len(list(recording.messages())) == 120
