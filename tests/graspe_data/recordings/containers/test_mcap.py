from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from mcap.writer import CompressionType, Writer

from graspe_data.recordings import open_recording

ROS1_HI = b"\2\0\0\0hi"
CDR_HI = b"\0\1\0\0\3\0\0\0hi\0"


def _mcap(
    path: Path, *, schema: str, encoding: str, name: str, data: bytes, **options: Any
) -> Path:
    with path.open("wb") as file:
        writer = Writer(file, **options)
        writer.start(profile="", library="")
        schema_id = writer.register_schema(name, schema, b"string data\n") if schema else 0
        channel = writer.register_channel("/x", encoding, schema_id)
        for number in (3, 1, 2):
            writer.add_message(channel, log_time=number, data=data, publish_time=number)
        writer.finish()  # type: ignore[no-untyped-call]
    return path


@pytest.mark.parametrize("name", ["std_msgs/String", "std_msgs/msg/String"])
@pytest.mark.parametrize(
    ("schema", "encoding", "data"), [("ros1msg", "ros1", ROS1_HI), ("ros2msg", "cdr", CDR_HI)]
)
def test_both_generations_of_schemas_and_type_names(
    tmp_path: Path, name: str, schema: str, encoding: str, data: bytes
) -> None:
    path = _mcap(tmp_path / "a.mcap", schema=schema, encoding=encoding, name=name, data=data)
    with open_recording(path) as recording:
        info = recording.topics["/x"]
        assert (info.message_type, info.encoding, info.count) == (
            "std_msgs/msg/String",
            encoding,
            3,
        )
        messages: Any = [recording.decode(raw) for raw in recording.messages()]
        assert [message.data for message in messages] == ["hi"] * 3


@pytest.mark.parametrize("compression", list(CompressionType))
def test_chunks_of_any_compression_in_time_order(tmp_path: Path, compression: Any) -> None:
    path = _mcap(
        tmp_path / "a.mcap",
        schema="ros2msg",
        encoding="cdr",
        name="std_msgs/msg/String",
        data=CDR_HI,
        compression=compression,
        chunk_size=1,
    )
    with open_recording(path) as recording:
        assert [raw.bag_time_ns for raw in recording.messages()] == [1, 2, 3]
        assert recording.losses == []


@pytest.mark.parametrize("options", [{"use_chunking": False}, {"use_summary_offsets": False}])
def test_files_without_chunks_or_offsets_lose_nothing(tmp_path: Path, options: Any) -> None:
    path = _mcap(
        tmp_path / "a.mcap",
        schema="ros2msg",
        encoding="cdr",
        name="std_msgs/msg/String",
        data=CDR_HI,
        **options,
    )
    with open_recording(path) as recording:
        assert sorted(raw.bag_time_ns for raw in recording.messages()) == [1, 2, 3]
        assert recording.topics["/x"].count == 3
        assert recording.losses == []


def test_real_splits_are_read_in_order(recordings: Path) -> None:
    with open_recording(recordings / "rosbag2_wbag_mcap_zstd") as recording:
        assert [file.name for file in recording.files] == [f"wbag_{i}.mcap" for i in range(5)]
        times = [raw.bag_time_ns for raw in recording.messages()]
        assert len(times) == 6074
        assert times == sorted(times)
        assert recording.topics["AAA"].count == 804
        assert recording.losses == []


@pytest.mark.parametrize(
    ("name", "count"),
    [("kitti_street_camera_lidar_odometry", 274), ("rerun_rosbag2_image_cloud_scan.mcap", 194)],
)
def test_real_files_are_read_whole_and_decode(recordings: Path, name: str, count: int) -> None:
    with open_recording(recordings / name) as recording:
        raws = list(recording.messages())
        assert len(raws) == count
        for raw in raws[:: count // 50]:
            recording.decode(raw)
        assert recording.losses == []
