"""SQLite files of recorders that were killed: what lies in the log beside them counts."""

from __future__ import annotations

import os
import shutil
import sqlite3
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from graspe_data.errors import RecordingError
from graspe_data.recordings import open_recording, recording_digest
from graspe_data.recordings.containers.sqlite_log import _checksum

SCHEMA = (
    (
        "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL,"
        " serialization_format TEXT NOT NULL, offered_qos_profiles TEXT NOT NULL)"
    ),
    (
        "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL,"
        " timestamp INTEGER NOT NULL, data BLOB NOT NULL)"
    ),
    "CREATE INDEX timestamp_idx ON messages (timestamp ASC)",
)
TOPIC = "INSERT INTO topics VALUES (1, '/x', 'std_msgs/msg/String', 'cdr', '')"
FILE = "rec_0.db3"


def _payload(number: int) -> bytes:
    return b"\0\1\0\0" + number.to_bytes(4, "little") * (1 + number % 700)


def _insert(database: sqlite3.Connection, numbers: range) -> None:
    database.execute("BEGIN")
    rows = [(number, 1, 1000 + number, _payload(number)) for number in numbers]
    database.executemany("INSERT INTO messages VALUES (?, ?, ?, ?)", rows)


def _killed(
    folder: Path,
    *,
    mode: str = "WAL",
    page_size: int = 4096,
    checkpointed: int = 0,
    committed: int = 90,
    begun: int = 0,
) -> Path:
    """What lies on the disk when a recorder dies: rows in the file, in the log, uncommitted."""
    work = folder / "work"
    work.mkdir(parents=True)
    database = sqlite3.connect(work / FILE, isolation_level=None)
    database.execute(f"PRAGMA page_size = {page_size}")
    database.execute(f"PRAGMA journal_mode = {mode}")
    database.execute("PRAGMA wal_autocheckpoint = 0")
    database.execute("PRAGMA cache_size = 5")
    for statement in (*SCHEMA, TOPIC):
        database.execute(statement)
    _insert(database, range(1, checkpointed + 1))
    database.execute("COMMIT")
    if mode == "WAL":
        if checkpointed:
            database.execute("PRAGMA wal_checkpoint(TRUNCATE)")
        for first in range(checkpointed + 1, committed + 1, 30):
            _insert(database, range(first, min(first + 30, committed + 1)))
            database.execute("COMMIT")
    if begun:
        _insert(database, range(committed + 1, committed + begun + 1))
    shutil.copytree(work, folder / "left")
    database.close()
    return folder / "left"


def _numbers(path: Path) -> list[int]:
    with open_recording(path) as recording:
        raws = list(recording.messages())
        assert all(bytes(raw.data) == _payload(raw.bag_time_ns - 1000) for raw in raws)
        return [raw.bag_time_ns - 1000 for raw in raws]


@pytest.mark.parametrize("page_size", [512, 4096, 65536])
@pytest.mark.parametrize("checkpointed", [0, 40])
def test_rows_in_the_log_are_read_as_sqlite_reads_them(
    tmp_path: Path, page_size: int, checkpointed: int
) -> None:
    left = _killed(tmp_path, page_size=page_size, checkpointed=checkpointed)
    assert (left / f"{FILE}-wal").stat().st_size > 0
    assert _numbers(left) == list(range(1, 91))
    with open_recording(left / FILE) as recording:
        assert recording.losses == []
        assert recording.topics["/x"].count == 90
    shutil.copytree(left, tmp_path / "oracle")
    oracle = sqlite3.connect(tmp_path / "oracle" / FILE)
    assert oracle.execute("SELECT count(*) FROM messages").fetchone() == (90,)
    oracle.close()


def test_nothing_beside_the_users_file_changes_and_the_copy_goes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    left = _killed(tmp_path)
    scratch = tmp_path / "scratch"
    scratch.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(scratch))
    before = {file.name: (file.read_bytes(), file.stat().st_mtime_ns) for file in left.iterdir()}
    left.chmod(0o555)
    with open_recording(left) as recording:
        assert list(scratch.iterdir())
        list(recording.messages())
    left.chmod(0o755)
    after = {file.name: (file.read_bytes(), file.stat().st_mtime_ns) for file in left.iterdir()}
    assert after == before
    assert not list(scratch.iterdir())


def test_a_transaction_that_was_not_committed_is_a_loss_in_messages(tmp_path: Path) -> None:
    left = _killed(tmp_path, committed=60, begun=200)
    with open_recording(left) as recording:
        assert [raw.bag_time_ns - 1000 for raw in recording.messages()] == list(range(1, 61))
        (loss,) = recording.losses
        assert 100 < (loss.messages or 0) <= 200
        assert f"{FILE}" in loss.reason


@pytest.mark.parametrize("damage", ["cut", "bit", "index"])
def test_a_damaged_tail_of_the_log_is_a_loss(tmp_path: Path, damage: str) -> None:
    left = _killed(tmp_path)
    log = left / f"{FILE}-wal"
    content = bytearray(log.read_bytes())
    if damage == "bit":
        content[len(content) * 3 // 4] ^= 1
        (left / f"{FILE}-shm").unlink()
    else:
        del content[len(content) * 3 // 4 :]
        if damage == "cut":
            (left / f"{FILE}-shm").unlink()
    log.write_bytes(content)
    found = _numbers(left)
    assert found == list(range(1, len(found) + 1))
    assert len(found) in (30, 60)
    with open_recording(left) as recording:
        assert recording.losses
        lost = sum(loss.messages or 0 for loss in recording.losses)
        assert lost == 90 - len(found) if damage == "bit" else lost <= 90 - len(found)


def test_tables_that_live_only_in_the_log(tmp_path: Path) -> None:
    left = _killed(tmp_path, committed=90)
    assert (left / FILE).stat().st_size <= 4096
    assert _numbers(left) == list(range(1, 91))
    (left / FILE).write_bytes(b"")
    assert _numbers(left) == list(range(1, 91))


def test_the_log_is_part_of_what_a_recording_is_known_by(tmp_path: Path) -> None:
    """Files of which nothing was copied from the log are the same for every recorder."""
    one, two = (_killed(tmp_path / str(count), committed=count) for count in (30, 90))
    assert (one / FILE).read_bytes()[100:] == (two / FILE).read_bytes()[100:]
    assert recording_digest(one) != recording_digest(two)
    assert recording_digest(one) == recording_digest(one / FILE)


def test_a_log_without_its_file_is_named(tmp_path: Path) -> None:
    left = _killed(tmp_path)
    (left / FILE).unlink()
    for path in (left, left / f"{FILE}-wal"):
        with pytest.raises(RecordingError, match=f"database {FILE}, which is missing"):
            open_recording(path)


def test_a_log_of_something_else_is_left_out_and_told(tmp_path: Path) -> None:
    left = _killed(tmp_path, checkpointed=90)
    (left / f"{FILE}-wal").write_bytes(b"no log at all" * 20)
    assert _numbers(left) == list(range(1, 91))
    with open_recording(left) as recording:
        assert "no write-ahead log" in recording.losses[0].reason


def test_a_hot_journal_undoes_what_was_half_written(tmp_path: Path) -> None:
    left = _killed(tmp_path, mode="DELETE", checkpointed=60, committed=60, begun=300)
    assert (left / f"{FILE}-journal").stat().st_size > 512
    shutil.copytree(left, tmp_path / "oracle")
    oracle = sqlite3.connect(tmp_path / "oracle" / FILE)
    count = oracle.execute("SELECT count(*) FROM messages").fetchone()[0]
    oracle.close()
    assert _numbers(left) == list(range(1, count + 1))
    with open_recording(left) as recording:
        assert "not committed" in recording.losses[0].reason


def test_a_journal_that_names_another_file_leaves_that_file_alone(tmp_path: Path) -> None:
    left = _killed(tmp_path, mode="DELETE", checkpointed=60, committed=60, begun=300)
    precious = tmp_path / "precious"
    precious.write_bytes(b"\xd9\xd5\x05\xf9\x20\xa1\x63\xd7")
    name = os.fsencode(precious)
    trailer = len(name).to_bytes(4, "big") + sum(name).to_bytes(4, "big")
    with (left / f"{FILE}-journal").open("ab") as journal:
        journal.write((1 << 18).to_bytes(4, "big") + name + trailer + precious.read_bytes())
    assert _numbers(left)
    assert precious.exists()


def test_no_copy_is_made_without_space(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    left = _killed(tmp_path)
    usage: Any = type("usage", (), {"free": 10})
    monkeypatch.setattr(shutil, "disk_usage", lambda _: usage)
    with pytest.raises(RecordingError, match="TMPDIR"):
        open_recording(left)


@pytest.mark.parametrize("order", ["<u4", ">u4"])
@pytest.mark.parametrize("pairs", [1, 2, 3, 129, 514])
def test_the_checksum_is_the_running_one(order: str, pairs: int) -> None:
    words = np.random.default_rng(pairs).integers(0, 1 << 32, 2 * pairs, np.uint64)
    one, two = 0xDEADBEEF, 0x12345678
    for first, second in words.reshape(-1, 2).tolist():
        one = (one + first + two) & 0xFFFFFFFF
        two = (two + second + one) & 0xFFFFFFFF
    data = words.astype(order).tobytes()
    assert _checksum(data, (0xDEADBEEF, 0x12345678), order) == (one, two)
