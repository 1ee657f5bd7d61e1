"""Foxglove's public schemas as protobuf classes, and messages of them in both encodings."""

from __future__ import annotations

import base64
import json
from datetime import UTC, datetime
from typing import Any

from google.protobuf import descriptor_pb2, descriptor_pool, message_factory, timestamp_pb2
from google.protobuf.json_format import ParseDict

# The fields of each schema: name, number, kind; kinds that are messages by their name.
SCHEMAS: dict[str, list[tuple[str, int, str]]] = {
    "Vector3": [("x", 1, "double"), ("y", 2, "double"), ("z", 3, "double")],
    "Quaternion": [("x", 1, "double"), ("y", 2, "double"), ("z", 3, "double"), ("w", 4, "double")],
    "Pose": [("position", 1, "Vector3"), ("orientation", 2, "Quaternion")],
    "PackedElementField": [("name", 1, "string"), ("offset", 2, "fixed32"), ("type", 3, "int32")],
    "CompressedImage": [
        ("timestamp", 1, "Timestamp"),
        ("frame_id", 4, "string"),
        ("data", 2, "bytes"),
        ("format", 3, "string"),
    ],
    "CompressedVideo": [
        ("timestamp", 1, "Timestamp"),
        ("frame_id", 2, "string"),
        ("data", 3, "bytes"),
        ("format", 4, "string"),
    ],
    "RawImage": [
        ("timestamp", 1, "Timestamp"),
        ("frame_id", 7, "string"),
        ("width", 2, "fixed32"),
        ("height", 3, "fixed32"),
        ("encoding", 4, "string"),
        ("step", 5, "fixed32"),
        ("data", 6, "bytes"),
    ],
    "CameraCalibration": [
        ("timestamp", 1, "Timestamp"),
        ("frame_id", 9, "string"),
        ("width", 2, "fixed32"),
        ("height", 3, "fixed32"),
        ("distortion_model", 4, "string"),
        ("D", 5, "double*"),
        ("K", 6, "double*"),
        ("R", 7, "double*"),
        ("P", 8, "double*"),
    ],
    "FrameTransform": [
        ("timestamp", 1, "Timestamp"),
        ("parent_frame_id", 2, "string"),
        ("child_frame_id", 3, "string"),
        ("translation", 4, "Vector3"),
        ("rotation", 5, "Quaternion"),
    ],
    "FrameTransforms": [("transforms", 1, "FrameTransform*")],
    "PoseInFrame": [("timestamp", 1, "Timestamp"), ("frame_id", 2, "string"), ("pose", 3, "Pose")],
    "LaserScan": [
        ("timestamp", 1, "Timestamp"),
        ("frame_id", 2, "string"),
        ("pose", 3, "Pose"),
        ("start_angle", 4, "double"),
        ("end_angle", 5, "double"),
        ("ranges", 6, "double*"),
        ("intensities", 7, "double*"),
    ],
    "PointCloud": [
        ("timestamp", 1, "Timestamp"),
        ("frame_id", 2, "string"),
        ("pose", 3, "Pose"),
        ("point_stride", 4, "fixed32"),
        ("fields", 5, "PackedElementField*"),
        ("data", 6, "bytes"),
    ],
}


def _classes() -> dict[str, Any]:
    """Protobuf classes built at run time: what protoc makes of the public schemas."""
    proto = descriptor_pb2.FieldDescriptorProto
    file = descriptor_pb2.FileDescriptorProto(
        name="foxglove/all.proto", package="foxglove", syntax="proto3"
    )
    file.dependency.append("google/protobuf/timestamp.proto")
    for name, fields in SCHEMAS.items():
        message = file.message_type.add(name=name)
        for field, number, kind in fields:
            label = proto.LABEL_REPEATED if kind.endswith("*") else proto.LABEL_OPTIONAL
            item = message.field.add(name=field, number=number, label=label)
            base = kind.removesuffix("*")
            if base == "Timestamp":
                item.type, item.type_name = proto.TYPE_MESSAGE, ".google.protobuf.Timestamp"
            elif base in SCHEMAS:
                item.type, item.type_name = proto.TYPE_MESSAGE, f".foxglove.{base}"
            else:
                item.type = getattr(proto, f"TYPE_{base.upper()}")
    pool = descriptor_pool.DescriptorPool()
    stamp = descriptor_pb2.FileDescriptorProto()
    timestamp_pb2.DESCRIPTOR.CopyToProto(stamp)
    pool.Add(stamp)
    pool.Add(file)
    return {
        name: message_factory.GetMessageClass(pool.FindMessageTypeByName(f"foxglove.{name}"))
        for name in SCHEMAS
    }


CLASSES = _classes()


def protobuf_message(kind: str, fields: dict[str, Any]) -> Any:
    """A message of a kind; bytes are bytes, times have ``sec`` and ``nsec``."""
    return ParseDict(_stamped(_base64(fields)), CLASSES[kind]())


def json_bytes(fields: dict[str, Any]) -> bytes:
    """A message as Foxglove writes it in JSON."""
    return json.dumps(_base64(fields)).encode()


def _base64(value: Any) -> Any:
    """Fields as JSON has them."""
    if isinstance(value, bytes):
        return base64.b64encode(value).decode()
    if isinstance(value, dict):
        return {key: _base64(item) for key, item in value.items()}
    return [_base64(item) for item in value] if isinstance(value, list) else value


def _stamped(value: Any) -> Any:
    """Fields as protobuf's own JSON has them: times as text."""
    if isinstance(value, dict):
        if value.keys() == {"sec", "nsec"}:
            return _moment(value["sec"], value["nsec"])
        return {key: _stamped(item) for key, item in value.items()}
    return [_stamped(item) for item in value] if isinstance(value, list) else value


def _moment(seconds: int, nanoseconds: int) -> str:
    moment = datetime.fromtimestamp(seconds, UTC)
    return f"{moment:%Y-%m-%dT%H:%M:%S}.{nanoseconds:09}Z"
