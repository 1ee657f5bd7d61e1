from __future__ import annotations

import shutil
import sqlite3
from pathlib import Path
from typing import Any

import pytest

from graspe_data.errors import RecordingError
from graspe_data.recordings import open_recording


@pytest.mark.parametrize("packing", ["none", "zstd_message", "zstd_file"])
def test_the_metadata_may_be_absent(write: Any, read: Any, packing: str) -> None:
    path = write("db3", packing)
    with_metadata = read(path)
    (path / "metadata.yaml").unlink()
    assert read(path) == with_metadata


@pytest.mark.parametrize("packing", ["none", "zstd_message", "zstd_file"])
def test_a_bare_file_reads_like_its_folder(
    write: Any, read: Any, single: Any, packing: str
) -> None:
    path = write("db3", packing)
    assert read(single(path)) == read(path)


def test_what_was_decompressed_is_removed(
    write: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = write("db3", "zstd_file")
    scratch = tmp_path / "scratch"
    scratch.mkdir()
    monkeypatch.setattr("tempfile.tempdir", str(scratch))
    with open_recording(path):
        assert list(scratch.iterdir())
    assert not list(scratch.iterdir())


def test_splits_are_read_by_number_without_metadata(write: Any, read: Any) -> None:
    folder = write("db3", count=3)
    content = read(folder)
    (folder / "metadata.yaml").unlink()
    (folder / "drive.db3").rename(folder / "drive_8.db3")
    for number in (9, 10):
        part = folder / f"drive_{number}.db3"
        shutil.copy(folder / "drive_8.db3", part)
        with sqlite3.connect(part) as database:
            shift = (number - 8) * 300_000_000
            database.execute("UPDATE messages SET timestamp = timestamp + ?", (shift,))
        database.close()
    with open_recording(folder) as recording:
        names = [file.name for file in recording.files]
    assert names == ["drive_8.db3", "drive_9.db3", "drive_10.db3"]
    assert [data for _, _, data in read(folder)] == [data for _, _, data in content] * 3


def test_rows_come_by_time_though_written_otherwise(write: Any, single: Any, read: Any) -> None:
    path = single(write("db3", count=5))
    with sqlite3.connect(path) as database:
        database.execute("UPDATE messages SET timestamp = 3000 - id")
    database.close()
    times = [time for _, time, _ in read(path)]
    assert times == sorted(times)


def test_a_listed_file_that_is_missing_is_a_loss(write: Any) -> None:
    path = write("db3", count=5)
    (path / "drive.db3").rename(path / "other.db3")
    with open_recording(path) as recording:
        assert len(list(recording.messages())) == 10
        assert any("drive.db3: listed in metadata.yaml" in loss.reason for loss in recording.losses)


@pytest.mark.parametrize("text", ["not: [yaml", "[]", "rosbag2_bagfile_information: 5", "a: !!x 1"])
def test_a_broken_metadata_is_a_loss_not_an_end(write: Any, text: str) -> None:
    path = write("db3", count=5)
    (path / "metadata.yaml").write_text(text)
    with open_recording(path) as recording:
        assert len(list(recording.messages())) == 10
        assert "metadata.yaml" in recording.losses[0].reason


def test_a_database_of_something_else_is_refused(tmp_path: Path) -> None:
    with sqlite3.connect(tmp_path / "a.db3") as database:
        database.execute("CREATE TABLE cats (name TEXT)")
    database.close()
    with pytest.raises(RecordingError, match="topics and messages are missing"):
        open_recording(tmp_path / "a.db3")


def test_a_cut_file_gives_its_rows_and_names_the_missing(
    write: Any, single: Any, read: Any
) -> None:
    path = single(write("db3", count=200))
    whole = read(path)
    content = path.read_bytes()
    path.write_bytes(content[: len(content) // 2])
    with open_recording(path) as recording:
        found = [(raw.topic, raw.bag_time_ns, bytes(raw.data)) for raw in recording.messages()]
        assert 0 < len(found) < len(whole)
        assert set(found) <= set(whole)
        assert any("read row by row" in loss.reason for loss in recording.losses)


@pytest.mark.parametrize(
    ("name", "count"),
    [
        ("rosbag2_message_compression", 1127),
        ("rosbag2_file_compression", 775),
        ("rosbag2_compressed_bag", 0),
    ],
)
def test_real_compressed_folders(recordings: Path, name: str, count: int) -> None:
    with open_recording(recordings / name) as recording:
        raws = list(recording.messages())
        assert len(raws) == count == sum(info.count or 0 for info in recording.topics.values())
        for raw in raws[::100]:
            recording.decode(raw)
        assert recording.losses == []


@pytest.mark.parametrize(("name", "packets"), [("nebula_vlp16", 151), ("nebula_vlp32", 76)])
def test_velodyne_scans_decode_without_definitions(
    recordings: Path, name: str, packets: int
) -> None:
    with open_recording(recordings / name) as recording:
        scans: Any = [recording.decode(raw) for raw in recording.messages()]
        assert abs(len(scans[1].packets) - packets) <= 1
        assert scans[0].packets[0].data.shape == (1206,)


def test_many_lost_rows_of_a_kind_are_one_loss(write: Any, single: Any) -> None:
    path = single(write("db3", "zstd_message", count=50))
    with sqlite3.connect(path) as database:
        database.execute("UPDATE messages SET data = x'28b52ffd00' WHERE topic_id = 2")
    database.close()
    with open_recording(path) as recording:
        assert len(list(recording.messages())) == 50
        assert [(loss.topic, loss.messages) for loss in recording.losses] == [("/words", 50)]
