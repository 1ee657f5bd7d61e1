from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from rosbags import rosbag1

from graspe_data.errors import RecordingError
from graspe_data.recordings import open_recording


def _bag(path: Path, topic: str, kind: str, definition: str, data: bytes) -> Path:
    with rosbag1.Writer(path) as writer:
        connection = writer.add_connection(topic, kind, msgdef=definition, md5sum="0" * 32)
        writer.write(connection, 1_000_000_007, data)
    return path


def test_messages_come_in_time_order_though_chunks_do_not(recordings: Path) -> None:
    with open_recording(recordings / "unsorted_chunks.bag") as recording:
        times = [raw.bag_time_ns for raw in recording.messages()]
    assert len(times) == 3
    assert times == sorted(times)


def test_three_compressions_of_one_recording_read_alike(recordings: Path, read: Any) -> None:
    plain = read(recordings / "turtle_none.bag")
    assert len(plain) == 8647
    assert read(recordings / "turtle_bz2.bag") == plain
    assert read(recordings / "turtle_lz4.bag") == plain


def test_the_order_is_that_of_rosbags(recordings: Path, read: Any) -> None:
    with rosbag1.Reader(recordings / "turtle_none.bag") as reader:
        expected = [(item.topic, time, data) for item, time, data in reader.messages()]
    assert read(recordings / "turtle_none.bag") == expected


def test_no_messages_is_a_recording_without_messages(recordings: Path) -> None:
    with open_recording(recordings / "no_messages.bag") as recording:
        assert list(recording.messages()) == []
        assert recording.losses == []


def test_two_names_of_one_layout_on_a_topic_are_both_read(recordings: Path) -> None:
    with open_recording(recordings / "zaki_scan_odom_tf_clockdrift.bag") as recording:
        raws = list(recording.messages(["/tf"]))
        assert recording.topics["/tf"].count == len(raws)
        assert all(hasattr(recording.decode(raw), "transforms") for raw in raws[::50])
        assert recording.losses == []


@pytest.mark.parametrize(
    ("name", "count"),
    [
        ("akimap_loam_cloud_tf.bag", 3173),
        ("embag_stage_scan_odom_lz4.bag", 3454),
        ("husky_odom_imu_gps_bz2.bag", 16806),
        ("fiducials_jpg_camera_info.bag", 16),
        ("rosnumpy_rgb8_cloud15.bag", 9),
    ],
)
def test_real_bags_are_read_whole_and_decode(recordings: Path, name: str, count: int) -> None:
    with open_recording(recordings / name) as recording:
        raws = list(recording.messages())
        assert len(raws) == count == sum(info.count or 0 for info in recording.topics.values())
        for raw in raws[:: max(1, count // 100)]:
            recording.decode(raw)
        assert recording.losses == []


def test_trailing_bytes_are_ignored(tmp_path: Path) -> None:
    path = _bag(tmp_path / "a.bag", "/x", "std_msgs/msg/String", "string data\n", b"\2\0\0\0hiXXXX")
    with open_recording(path) as recording:
        message: Any = recording.decode(next(recording.messages()))
    assert message.data == "hi"


def test_a_message_that_does_not_decode_names_topic_and_time(tmp_path: Path) -> None:
    path = _bag(tmp_path / "a.bag", "/x", "std_msgs/msg/String", "string data\n", b"\x09\0\0\0hi")
    with open_recording(path) as recording:
        raw = next(recording.messages())
        with pytest.raises(RecordingError, match="topic /x at 1000000007 ns: 6 bytes are no std"):
            recording.decode(raw)


def test_an_empty_definition_means_the_standard_one(tmp_path: Path) -> None:
    path = _bag(tmp_path / "a.bag", "/x", "std_msgs/msg/String", "", b"\2\0\0\0hi")
    with open_recording(path) as recording:
        assert recording.topics["/x"].message_type == "std_msgs/msg/String"
        message: Any = recording.decode(next(recording.messages()))
    assert message.data == "hi"


def test_a_definition_of_ones_own_is_used(tmp_path: Path) -> None:
    definition = "Header header\nInner[] parts\n" + "=" * 80 + "\nMSG: my_msgs/Inner\nuint16 size\n"
    data = b"\1\0\0\0\2\0\0\0\3\0\0\0\0\0\0\0\1\0\0\0\5\0"
    path = _bag(tmp_path / "a.bag", "/x", "my_msgs/msg/Outer", definition, data)
    with open_recording(path) as recording:
        raw = next(recording.messages())
        message: Any = recording.decode(raw)
        assert recording.header_stamp_ns(raw) == 2_000_000_003
    assert [part.size for part in message.parts] == [5]


@pytest.mark.parametrize(
    "definition",
    ["what is this", "uint8[999999999] x\n", "Missing part\n", "uint8 class\nuint8 class\n"],
)
def test_a_hostile_definition_costs_the_decoding_only(tmp_path: Path, definition: str) -> None:
    path = _bag(tmp_path / "a.bag", "/x", "my_msgs/msg/Bad", definition, b"\0\0\0\0")
    with open_recording(path) as recording:
        raw = next(recording.messages())
        assert recording.header_stamp_ns(raw) is None
        with pytest.raises(RecordingError, match="topic /x"):
            recording.decode(raw)


def test_an_unknown_topic_lists_those_that_are_there(write: Any) -> None:
    with (
        open_recording(write("bag")) as recording,
        pytest.raises(RecordingError, match=r"no topic /nope; it has /camera, /words\."),
    ):
        recording.messages(["/nope"])


@pytest.mark.parametrize("recorder", ["ROSBAG", "ROSRECORD", "ROSLOG"])
@pytest.mark.parametrize("version", ["1.0", "1.1", "1.2", "2.1", "3.0"])
@pytest.mark.parametrize("name", ["old.bag", "old"])
def test_another_version_is_named_with_a_way_out(
    tmp_path: Path, recorder: str, version: str, name: str
) -> None:
    (tmp_path / name).write_bytes(f"#{recorder} V{version}\nrest".encode())
    with pytest.raises(RecordingError, match=rf"of version {version}; .*rosbag fix"):
        open_recording(tmp_path / name)


@pytest.mark.parametrize("content", [b"", b"hello, I am a text", b"\x28\xb5\x2f\xfd broken"])
def test_a_file_that_is_no_recording_is_refused(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "notes.db3").write_bytes(content)
    with pytest.raises(RecordingError, match=r"notes\.db3"):
        open_recording(tmp_path / "notes.db3")


def test_missing_files_and_empty_folders_are_refused(tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match="no such file or folder"):
        open_recording(tmp_path / "none")
    with pytest.raises(RecordingError, match="no recording in it"):
        open_recording(tmp_path)
