from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from graspe_data.errors import RecordingError
from graspe_data.recordings import RecordingWriter, open_recording, recording_digest
from graspe_data.recordings.message_types import message_classes
from graspe_data.recordings.writing import COMPRESSIONS

VARIANTS = [(box, packing) for box, packings in COMPRESSIONS.items() for packing in packings]


@pytest.mark.parametrize(("container", "compression"), VARIANTS)
def test_every_container_gives_back_what_was_written(
    write: Any, container: Any, compression: Any
) -> None:
    path = write(container, compression, count=20)
    with open_recording(path) as recording:
        assert {name: info.count for name, info in recording.topics.items()} == {
            "/camera": 20,
            "/words": 20,
        }
        found = list(recording.messages())
        assert len(found) == 40
        assert [raw.bag_time_ns for raw in found] == sorted(raw.bag_time_ns for raw in found)
        words: Any = [recording.decode(raw) for raw in recording.messages(["/words"])]
        assert [word.data for word in words] == [f"number {number}" for number in range(20)]
        assert recording.losses == []


@pytest.mark.parametrize(("container", "compression"), VARIANTS)
def test_the_same_messages_give_the_same_bytes(
    write: Any, container: Any, compression: Any, tmp_path: Path
) -> None:
    first = write(container, compression, count=20)
    again = recording_digest(first)
    first.rename(tmp_path / ("first" + first.suffix))
    assert recording_digest(write(container, compression, count=20)) == again


@pytest.mark.parametrize(("container", "name"), [("bag", "a.bag"), ("db3", "a"), ("mcap", "a")])
def test_a_stamp_is_read_without_decoding(write: Any, container: Any, name: str) -> None:
    with open_recording(write(container)) as recording:
        for raw in recording.messages():
            message: Any = recording.decode(raw)
            if raw.topic == "/words":
                assert recording.header_stamp_ns(raw) is None
            else:
                stamp = message.header.stamp
                assert recording.header_stamp_ns(raw) == stamp.sec * 10**9 + stamp.nanosec


def test_transforms_and_velodyne_scans_are_written_to_every_container(tmp_path: Path) -> None:
    classes: Any = message_classes()
    stamp = classes["builtin_interfaces/msg/Time"](1, 2)
    header = classes["std_msgs/msg/Header"](stamp, "velodyne")
    for container, name in (("bag", "a.bag"), ("db3", "b"), ("mcap", "c")):
        with RecordingWriter(tmp_path / name, container) as writer:  # type: ignore[arg-type]
            writer.write("/tf", classes["tf2_msgs/msg/TFMessage"]([]), 5)
            writer.write("/scan", classes["velodyne_msgs/msg/VelodyneScan"](header, []), 6)
        with open_recording(tmp_path / name) as recording:
            kinds = [type(recording.decode(raw)).__name__ for raw in recording.messages()]
            assert kinds == ["tf2_msgs__msg__TFMessage", "velodyne_msgs__msg__VelodyneScan"]


def test_a_message_that_ros1_lays_out_otherwise_is_refused(tmp_path: Path) -> None:
    classes: Any = message_classes()
    header = classes["std_msgs/msg/Header"](classes["builtin_interfaces/msg/Time"](1, 2), "")
    message = classes["sensor_msgs/msg/Range"](header, 0, 0.1, 0.1, 1.0, 0.5, 0.0)
    with (
        pytest.raises(RecordingError, match="ROS 1 has no sensor_msgs/msg/Range"),
        RecordingWriter(tmp_path / "a.bag", "bag") as writer,
    ):
        writer.write("/range", message, 1)


def test_a_second_type_on_a_topic_is_refused(tmp_path: Path) -> None:
    classes: Any = message_classes()
    with RecordingWriter(tmp_path / "a", "mcap") as writer:
        writer.write("/x", classes["std_msgs/msg/String"]("a"), 1)
        with pytest.raises(RecordingError, match="topic /x is std_msgs/msg/String"):
            writer.write("/x", classes["std_msgs/msg/Int32"](1), 2)


def test_bad_arguments_say_what_is_possible(tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match="choose one of none, bz2, lz4"):
        RecordingWriter(tmp_path / "a.bag", "bag", "zstd")
    with pytest.raises(RecordingError, match="exists already"):
        RecordingWriter(tmp_path, "mcap")


def test_memory_holds_one_chunk_not_the_recording(
    write: Any, single: Callable[[Path], Path]
) -> None:
    import tracemalloc  # noqa: PLC0415

    path = write("mcap", "zstd", count=2000)
    with open_recording(path) as recording:
        tracemalloc.start()
        assert sum(1 for _ in recording.messages()) == 4000
        peak = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
    assert peak < single(path).stat().st_size / 2


@pytest.mark.parametrize(("container", "name"), [("bag", "a.bag"), ("db3", "a"), ("mcap", "a")])
def test_a_type_that_begins_with_its_stamp_has_it_read(
    tmp_path: Path, container: Any, name: str
) -> None:
    classes: Any = message_classes()
    stamp = classes["builtin_interfaces/msg/Time"](7, 9)
    video = classes["foxglove_msgs/msg/CompressedVideo"](stamp, "eye", np.zeros(3, "u1"), "h264")
    clock = classes["rosgraph_msgs/msg/Clock"](stamp)
    with RecordingWriter(tmp_path / name, container) as writer:
        writer.write("/video", video, 1)
        writer.write("/clock", clock, 2)
    with open_recording(tmp_path / name) as recording:
        found = {raw.topic: recording.header_stamp_ns(raw) for raw in recording.messages()}
    assert found == {"/video": 7_000_000_009, "/clock": None}
