"""Positions rise in the order in which messages were written, whatever order they are read in."""

from __future__ import annotations

import shutil
import sqlite3
from pathlib import Path
from typing import Any

import pytest
from mcap.writer import CompressionType, Writer

from graspe_data.recordings import RawMessage, open_recording
from graspe_data.recordings.writing import COMPRESSIONS

PACKINGS = [
    (container, packing) for container in COMPRESSIONS for packing in COMPRESSIONS[container]
]
TWICE = [*range(0, 3000, 100), *range(0, 3000, 100)]


def _in_written_order(path: Path) -> list[RawMessage]:
    with open_recording(path) as recording:
        raws = list(recording.messages())
    assert len({raw.position for raw in raws}) == len(raws)
    return sorted(raws, key=lambda raw: raw.position)


def _mcap(path: Path, times: list[int], chunk_size: int = 300, **options: Any) -> Path:
    with path.open("wb") as file:
        writer = Writer(file, chunk_size=chunk_size, **options)
        writer.start()
        channel = writer.register_channel("/x", "cdr", writer.register_schema("a/B", "", b""))
        for number, time in enumerate(times):
            writer.add_message(channel, time, f"{number:08}".encode(), time)
        writer.finish()  # type: ignore[no-untyped-call]
    return path


@pytest.mark.parametrize(("container", "packing"), PACKINGS)
def test_positions_rise_with_the_order_of_writing(write: Any, container: Any, packing: Any) -> None:
    times = [raw.bag_time_ns for raw in _in_written_order(write(container, packing))]
    assert times == sorted(times)
    assert len(times) == 120


@pytest.mark.parametrize("compression", list(CompressionType))
@pytest.mark.parametrize(
    "times", [TWICE, [5000, 4000, 3000, 2000, 1000], list(range(2000, 0, -7)), [1, 1, 1]]
)
def test_times_that_start_again_or_fall_are_told_from_the_order_of_chunks(
    tmp_path: Path, compression: Any, times: list[int]
) -> None:
    path = _mcap(tmp_path / "a.mcap", times, compression=compression)
    written = _in_written_order(path)
    assert [raw.bag_time_ns for raw in written] == times
    with open_recording(path) as recording:
        read = [raw.bag_time_ns for raw in recording.messages()]
    assert read == sorted(times)


def test_loose_messages_and_those_after_a_salvage_keep_their_order(tmp_path: Path) -> None:
    loose = _mcap(tmp_path / "a.mcap", TWICE, use_chunking=False)
    assert [raw.bag_time_ns for raw in _in_written_order(loose)] == TWICE
    cut = _mcap(tmp_path / "b.mcap", TWICE)
    cut.write_bytes(cut.read_bytes()[: cut.stat().st_size * 2 // 3])
    found = [raw.bag_time_ns for raw in _in_written_order(cut)]
    assert found == TWICE[: len(found)]
    assert len(found) > 30


@pytest.mark.parametrize("packing", ["none", "bz2", "lz4"])
def test_a_bag_whose_end_is_lost_keeps_its_order(write: Any, packing: Any) -> None:
    path = write("bag", packing)
    path.write_bytes(path.read_bytes()[: path.stat().st_size * 2 // 3])
    times = [raw.bag_time_ns for raw in _in_written_order(path)]
    assert times == sorted(times)
    assert len(times) > 40


@pytest.mark.parametrize("in_order", [True, False])
def test_rows_are_placed_by_their_number(write: Any, single: Any, in_order: bool) -> None:
    path = single(write("db3", count=20))
    with sqlite3.connect(path) as database:
        database.execute("UPDATE messages SET timestamp = (id * 7) % 41")
        if not in_order:
            database.execute("DELETE FROM messages WHERE id IN (5, 30)")
    database.close()
    rows = [number for number in range(1, 41) if in_order or number not in (5, 30)]
    times = [raw.bag_time_ns for raw in _in_written_order(path)]
    assert times == [number * 7 % 41 for number in rows]


@pytest.mark.parametrize("container", ["db3", "mcap"])
def test_the_files_of_a_recording_follow_each_other(
    write: Any, single: Any, container: Any
) -> None:
    folder = write(container, count=30)
    first = single(folder)
    for number in (1, 2):
        shutil.copy(first, first.with_name(f"{first.stem}_{number}{first.suffix}"))
    (folder / "metadata.yaml").unlink()
    with open_recording(folder) as recording:
        positions = [raw.position for raw in recording.messages()]
    assert positions == sorted(set(positions))
    assert len(positions) == 180
