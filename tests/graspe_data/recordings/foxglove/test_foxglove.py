"""Foxglove's kinds in JSON and protobuf are read as the ROS messages that say the same."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mcap.writer import CompressionType, Writer
from mcap_protobuf.writer import Writer as ProtobufWriter

from graspe_data.errors import RecordingError
from graspe_data.geometry import Transform
from graspe_data.recordings import Recording, open_recording
from graspe_data.recordings.decoding import decode_points
from graspe_data.recordings.foxglove.messages import KINDS
from tests.graspe_data.recordings.foxglove.schemas import json_bytes, protobuf_message

SECONDS, NANOSECONDS = 1_700_000_000, 123_456_789
STAMP_NS = SECONDS * 10**9 + NANOSECONDS
STAMP = {"sec": SECONDS, "nsec": NANOSECONDS}
POINTS = np.array(
    [(1.0, 2.0, 3.0, 7.0, 1), (-1.0, 0.5, 0.25, 9.0, 2)],
    np.dtype([("x", "<f4"), ("y", "<f4"), ("z", "<f4"), ("intensity", "<f4"), ("ring", "<u2")]),
)
TURN = {"x": 0.0, "y": 0.0, "z": 0.5**0.5, "w": 0.5**0.5}
PLACE = {"x": 10.0, "y": 20.0, "z": 30.0}
POINT_FIELDS = [
    {"name": "x", "offset": 0, "type": 7},
    {"name": "y", "offset": 4, "type": 7},
    {"name": "z", "offset": 8, "type": 7},
    {"name": "intensity", "offset": 12, "type": 7},
    {"name": "ring", "offset": 16, "type": 3},
]
EDGE = {
    "timestamp": STAMP,
    "parent_frame_id": "odom",
    "child_frame_id": "base_link",
    "translation": PLACE,
    "rotation": TURN,
}
CALIBRATION = {
    "timestamp": STAMP,
    "frame_id": "cam",
    "width": 96,
    "height": 64,
    "distortion_model": "plumb_bob",
    "D": [0.1, -0.2, 0.0, 0.0, 0.0],
    "K": [80.0, 0.0, 47.5, 0.0, 81.0, 31.5, 0.0, 0.0, 1.0],
}
PIXELS = bytes(range(3 * 4 * 2))


def _json(path: Path, kind: str, fields: dict[str, Any]) -> Path:
    with path.open("wb") as file:
        writer = Writer(file, compression=CompressionType.ZSTD)
        writer.start()
        schema = writer.register_schema(f"foxglove.{kind}", "jsonschema", b'{"type": "object"}')
        channel = writer.register_channel("/topic", "json", schema)
        writer.add_message(channel, STAMP_NS + 5, json_bytes(fields), STAMP_NS)
        writer.finish()  # type: ignore[no-untyped-call]
    return path


def _protobuf(path: Path, kind: str, fields: dict[str, Any]) -> Path:
    message = protobuf_message(kind, fields)
    with path.open("wb") as file, ProtobufWriter(file) as writer:
        writer.write_message("/topic", message, STAMP_NS + 5, STAMP_NS)
    return path


WRITERS: list[Callable[[Path, str, dict[str, Any]], Path]] = [_json, _protobuf]


def _decoded(recording: Recording) -> Any:
    (raw,) = recording.messages()
    return recording.decode(raw)


@pytest.mark.parametrize("writer", WRITERS)
@pytest.mark.parametrize(
    ("kind", "fields", "expected"),
    [
        (
            "CompressedImage",
            {"timestamp": STAMP, "frame_id": "cam", "data": b"\xff\xd8\x00", "format": "jpeg"},
            {"format": "jpeg", "data": [255, 216, 0], "header.frame_id": "cam"},
        ),
        (
            "RawImage",
            {
                "timestamp": STAMP,
                "frame_id": "cam",
                "width": 4,
                "height": 2,
                "encoding": "rgb8",
                "step": 12,
                "data": PIXELS,
            },
            {"width": 4, "height": 2, "step": 12, "encoding": "rgb8", "data": list(PIXELS)},
        ),
        (
            "CameraCalibration",
            CALIBRATION,
            {
                "width": 96,
                "height": 64,
                "k": CALIBRATION["K"],
                "d": CALIBRATION["D"],
                "r": [1.0, 0, 0, 0, 1, 0, 0, 0, 1],
                "p": [80.0, 0, 47.5, 0, 0, 81, 31.5, 0, 0, 0, 1, 0],
                "distortion_model": "plumb_bob",
            },
        ),
        (
            "PoseInFrame",
            {
                "timestamp": STAMP,
                "frame_id": "odom",
                "pose": {"position": PLACE, "orientation": TURN},
            },
            {"pose.position.y": 20.0, "pose.orientation.w": TURN["w"], "header.frame_id": "odom"},
        ),
        (
            "LaserScan",
            {
                "timestamp": STAMP,
                "frame_id": "scan",
                "start_angle": -1.0,
                "end_angle": 1.0,
                "ranges": [1.0, 2.0, 3.0, 4.0, 5.0],
            },
            {"angle_min": -1.0, "angle_increment": 0.5, "ranges": [1.0, 2.0, 3.0, 4.0, 5.0]},
        ),
    ],
)
def test_kinds_with_a_header(
    tmp_path: Path, writer: Any, kind: str, fields: dict[str, Any], expected: dict[str, Any]
) -> None:
    with open_recording(writer(tmp_path / "a.mcap", kind, fields)) as recording:
        assert recording.topics["/topic"].message_type == KINDS[f"foxglove.{kind}"][0]
        message = _decoded(recording)
        for path, value in expected.items():
            found = message
            for name in path.split("."):
                found = getattr(found, name)
            assert (list(found) if isinstance(value, list) else found) == value
        assert (message.header.stamp.sec, message.header.stamp.nanosec) == (SECONDS, NANOSECONDS)
        (raw,) = recording.messages()
        assert recording.header_stamp_ns(raw) == STAMP_NS
        assert recording.losses == []


@pytest.mark.parametrize("writer", WRITERS)
@pytest.mark.parametrize(
    ("kind", "fields"),
    [("FrameTransform", EDGE), ("FrameTransforms", {"transforms": [EDGE, EDGE]})],
)
def test_transforms(tmp_path: Path, writer: Any, kind: str, fields: dict[str, Any]) -> None:
    with open_recording(writer(tmp_path / "a.mcap", kind, fields)) as recording:
        assert recording.topics["/topic"].message_type == "tf2_msgs/msg/TFMessage"
        transforms = _decoded(recording).transforms
        assert len(transforms) == len(fields.get("transforms", [0]))
        edge = transforms[-1]
        assert (edge.header.frame_id, edge.child_frame_id) == ("odom", "base_link")
        assert edge.transform.translation.z == 30.0
        assert edge.transform.rotation.z == TURN["z"]
        (raw,) = recording.messages()
        assert recording.header_stamp_ns(raw) is None


def test_a_video_is_what_ros_calls_foxglove_msgs(tmp_path: Path) -> None:
    fields = {"timestamp": STAMP, "frame_id": "cam", "data": b"\0\0\0\1", "format": "h264"}
    with open_recording(_protobuf(tmp_path / "a.mcap", "CompressedVideo", fields)) as recording:
        message = _decoded(recording)
        assert message.__msgtype__ == "foxglove_msgs/msg/CompressedVideo"
        assert (message.format, message.frame_id, message.timestamp.sec) == ("h264", "cam", SECONDS)
        (raw,) = recording.messages()
        assert recording.header_stamp_ns(raw) == STAMP_NS


@pytest.mark.parametrize("writer", WRITERS)
@pytest.mark.parametrize("pose", [None, {"position": PLACE, "orientation": TURN}])
def test_points_lie_in_the_frame_of_the_cloud(
    tmp_path: Path, writer: Any, pose: dict[str, Any] | None
) -> None:
    fields = {
        "timestamp": STAMP,
        "frame_id": "lidar",
        "point_stride": 18,
        "fields": POINT_FIELDS,
        "data": POINTS.tobytes(),
        **({"pose": pose} if pose else {}),
    }
    with open_recording(writer(tmp_path / "a.mcap", "PointCloud", fields)) as recording:
        message = _decoded(recording)
        cloud = decode_points(message, "/topic")
    points: Any = np.stack([POINTS["x"], POINTS["y"], POINTS["z"]], axis=-1).astype(np.float64)
    if pose:
        turn = np.array([*TURN.values()])
        points = Transform.from_quaternion(np.array([*PLACE.values()]), turn).apply(points)
        assert points[0] == pytest.approx([10.0 - 2.0, 20.0 + 1.0, 33.0])
    assert cloud.xyz == pytest.approx(points, abs=1e-5)
    assert cloud.ring is not None
    assert list(cloud.ring) == [1, 2]
    assert [field.datatype for field in message.fields] == [7, 7, 7, 7, 4]


@pytest.mark.parametrize(
    ("kind", "fields"),
    [
        ("RawImage", {"width": 4}),
        ("RawImage", {"timestamp": STAMP, "width": -4}),
        ("RawImage", {"timestamp": STAMP, "width": 1.5}),
        ("RawImage", {"timestamp": STAMP, "data": 5}),
        ("RawImage", {"timestamp": {"sec": 1 << 40}}),
        ("RawImage", {"timestamp": STAMP, "frame_id": 7}),
        ("CompressedImage", {"timestamp": STAMP, "data": "not base64!"}),
        ("CameraCalibration", {"timestamp": STAMP, "K": [1.0, 2.0]}),
        ("CameraCalibration", {"timestamp": STAMP, "K": [[1.0] * 3] * 3}),
        ("PointCloud", {"timestamp": STAMP, "point_stride": 0}),
        ("PointCloud", {"timestamp": STAMP, "point_stride": 5, "data": "AAAA"}),
        ("FrameTransforms", {"transforms": {"a": 1}}),
        ("FrameTransform", {**EDGE, "translation": [1, 2, 3]}),
        ("FrameTransform", {**EDGE, "translation": {"x": "one"}}),
        ("LaserScan", {"timestamp": STAMP, "pose": {"position": PLACE}}),
    ],
)
def test_a_message_that_does_not_fit_its_schema_is_named(
    tmp_path: Path, kind: str, fields: dict[str, Any]
) -> None:
    path = tmp_path / "a.mcap"
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start()
        schema = writer.register_schema(f"foxglove.{kind}", "jsonschema", b"{}")
        channel = writer.register_channel("/topic", "json", schema)
        for data in (json.dumps(fields).encode(), b"[" * 100_000, b"[]", b"\xff", b""):
            writer.add_message(channel, 1, data, 1)
        writer.finish()  # type: ignore[no-untyped-call]
    with open_recording(path) as recording:
        for raw in recording.messages():
            recording.header_stamp_ns(raw)
            with pytest.raises(RecordingError, match="topic /topic at 1 ns"):
                recording.decode(raw)


@pytest.mark.parametrize("encoding", ["cbor", "flatbuffer", "x-own", "json", "protobuf"])
def test_what_is_not_decoded_is_named_with_its_encoding(tmp_path: Path, encoding: str) -> None:
    path = tmp_path / "a.mcap"
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start()
        schema = writer.register_schema("acme.Thing", encoding, b"whatever")
        writer.add_message(writer.register_channel("/topic", encoding, schema), 1, b"{}", 1)
        writer.finish()  # type: ignore[no-untyped-call]
    with open_recording(path) as recording:
        assert recording.topics["/topic"].encoding == encoding
        (raw,) = recording.messages()
        assert recording.header_stamp_ns(raw) is None
        with pytest.raises(RecordingError, match=f"encoded as '{encoding}'"):
            recording.decode(raw)


@pytest.mark.parametrize("descriptors", [b"", b"\xff" * 40, b"\x0a\x02\x0a\x00" * 2])
def test_damaged_descriptors_are_named(tmp_path: Path, descriptors: bytes) -> None:
    path = tmp_path / "a.mcap"
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start()
        schema = writer.register_schema("foxglove.RawImage", "protobuf", descriptors)
        writer.add_message(writer.register_channel("/topic", "protobuf", schema), 1, b"\x12", 1)
        writer.finish()  # type: ignore[no-untyped-call]
    with open_recording(path) as recording:
        (raw,) = recording.messages()
        with pytest.raises(RecordingError, match="descriptors in the recording are damaged"):
            recording.decode(raw)
