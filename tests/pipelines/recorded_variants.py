"""A sound recording as other writers leave it: what a killed recorder leaves, other encodings."""

from __future__ import annotations

import shutil
import sqlite3
from collections.abc import Callable
from pathlib import Path
from typing import Any

import zstandard
from mcap.writer import CompressionType, Writer
from mcap_protobuf.schema import build_file_descriptor_set

from graspe_data.recordings import open_recording
from tests.graspe_data.recordings.foxglove.schemas import CLASSES, json_bytes, protobuf_message
from tests.graspe_data.recordings.idl_text import idl_sections

CHUNK = 1 << 15
NUMERIC = {1: 2, 2: 1, 3: 4, 4: 3, 5: 6, 6: 5, 7: 7, 8: 8}


def write_variants(folder: Path, container: str) -> None:
    """Write the variants of a container beside the recording that was not compressed."""
    if container == "db3":
        killed_recorder(next((folder / "none").glob("*.db3")), folder / "wal")
    if container == "mcap":
        packed_messages(folder / "none", folder / "zstd_message")
        for encoding in ("json", "protobuf"):
            foxglove(folder / "none", folder / encoding, encoding)


def killed_recorder(source: Path, target: Path) -> None:
    """Half of the messages in the file, half in its log, and some not committed."""
    work = target.with_name(f"{target.name}_work")
    work.mkdir()
    read, write = sqlite3.connect(source), sqlite3.connect(work / source.name, isolation_level=None)
    write.execute("PRAGMA journal_mode = WAL")
    write.execute("PRAGMA wal_autocheckpoint = 0")
    tables = read.execute(
        "SELECT name, sql FROM sqlite_master WHERE sql IS NOT NULL ORDER BY type DESC"
    )
    for name, statement in list(tables):
        write.execute(statement)
        if name != "messages" and statement.startswith("CREATE TABLE"):
            _insert(write, name, read.execute(f"SELECT * FROM {name}").fetchall())  # noqa: S608
    rows = read.execute("SELECT * FROM messages ORDER BY id").fetchall()
    half = len(rows) // 2
    _insert(write, "messages", rows[:half])
    write.execute("PRAGMA wal_checkpoint(TRUNCATE)")
    _insert(write, "messages", rows[half:])
    shutil.copytree(work, target)
    for database in (read, write):
        database.close()
    shutil.rmtree(work)


def _insert(database: sqlite3.Connection, table: str, rows: list[tuple[Any, ...]]) -> None:
    database.execute("BEGIN")
    for row in rows:
        marks = ",".join("?" * len(row))
        database.execute(f"INSERT INTO {table} VALUES ({marks})", row)  # noqa: S608
    database.execute("COMMIT")


def packed_messages(source: Path, target: Path) -> None:
    """Payloads compressed one by one, and definitions in IDL."""
    pack = zstandard.ZstdCompressor().compress
    _rewrite(source, target, lambda raw, _: ("cdr", None, pack(bytes(raw.data))))


def foxglove(source: Path, target: Path, encoding: str) -> None:
    """What Foxglove has a kind for in its encoding, the rest as ROS writes it."""

    def convert(raw: Any, message: Any) -> tuple[str, str | None, bytes]:
        kind, fields_of = KINDS.get(message.__msgtype__, (None, None))
        if kind is None or fields_of is None:
            return "cdr", None, bytes(raw.data)
        fields = fields_of(message)
        if encoding == "json":
            return "json", kind, json_bytes(fields)
        return "protobuf", kind, protobuf_message(kind, fields).SerializeToString()

    _rewrite(source, target, convert)


def _rewrite(
    source: Path, target: Path, convert: Callable[[Any, Any], tuple[str, str | None, bytes]]
) -> None:
    target.mkdir()
    with open_recording(source) as recording, (target / "drive_0.mcap").open("wb") as file:
        writer = Writer(file, chunk_size=CHUNK, compression=CompressionType.LZ4)
        writer.start(profile="ros2")
        channels: dict[str, int] = {}
        for raw in recording.messages():
            encoding, kind, data = convert(raw, recording.decode(raw))
            if raw.topic not in channels:
                schema = _schema(writer, kind, encoding, recording.topics[raw.topic].message_type)
                channels[raw.topic] = writer.register_channel(raw.topic, encoding, schema)
            writer.add_message(channels[raw.topic], raw.bag_time_ns, data, raw.bag_time_ns)
        writer.finish()  # type: ignore[no-untyped-call]


def _schema(writer: Writer, kind: str | None, encoding: str, message_type: str) -> int:
    if kind is None:
        name, form, content = message_type, "ros2idl", idl_sections(message_type).encode()
    elif encoding == "json":
        name, form, content = f"foxglove.{kind}", "jsonschema", b'{"type": "object"}'
    else:
        content = build_file_descriptor_set(CLASSES[kind]).SerializeToString()
        name, form = f"foxglove.{kind}", "protobuf"
    number: int = writer.register_schema(name, form, content)
    return number


def _stamped(header: Any, frame: str = "frame_id") -> dict[str, Any]:
    stamp = {"sec": header.stamp.sec, "nsec": header.stamp.nanosec}
    return {"timestamp": stamp, frame: header.frame_id}


def _compressed_image(message: Any) -> dict[str, Any]:
    data = message.data.tobytes()
    return {**_stamped(message.header), "format": message.format, "data": data}


def _image(message: Any) -> dict[str, Any]:
    names = ("width", "height", "encoding", "step")
    fields = {name: getattr(message, name) for name in names}
    return {**_stamped(message.header), **fields, "data": message.data.tobytes()}


def _calibration(message: Any) -> dict[str, Any]:
    names = ("width", "height", "distortion_model")
    matrices = {name.upper(): getattr(message, name).tolist() for name in "dkrp"}
    fields = {name: getattr(message, name) for name in names}
    return {**_stamped(message.header), **fields, **matrices}


def _cloud(message: Any) -> dict[str, Any]:
    described = [
        {"name": field.name, "offset": field.offset, "type": NUMERIC[field.datatype]}
        for field in message.fields
    ]
    data = message.data.tobytes()
    fields = {"point_stride": message.point_step, "fields": described, "data": data}
    return {**_stamped(message.header), **fields}


def _transforms(message: Any) -> dict[str, Any]:
    return {
        "transforms": [
            {
                **_stamped(edge.header, "parent_frame_id"),
                "child_frame_id": edge.child_frame_id,
                "translation": _axes(edge.transform.translation, "xyz"),
                "rotation": _axes(edge.transform.rotation, "xyzw"),
            }
            for edge in message.transforms
        ]
    }


def _axes(value: Any, names: str) -> dict[str, float]:
    return {name: float(getattr(value, name)) for name in names}


KINDS: dict[str, tuple[str, Callable[[Any], dict[str, Any]]]] = {
    "sensor_msgs/msg/CompressedImage": ("CompressedImage", _compressed_image),
    "sensor_msgs/msg/Image": ("RawImage", _image),
    "sensor_msgs/msg/CameraInfo": ("CameraCalibration", _calibration),
    "sensor_msgs/msg/PointCloud2": ("PointCloud", _cloud),
    "tf2_msgs/msg/TFMessage": ("FrameTransforms", _transforms),
}
