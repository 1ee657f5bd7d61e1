"""Foxglove's kinds of message as ROS messages; fields as in github.com/foxglove/foxglove-sdk."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from graspe_data.geometry import Transform
from graspe_data.recordings.foxglove.fields import (
    Fields,
    content,
    group,
    groups,
    number,
    numbers,
    text,
    time,
    whole,
)
from graspe_data.recordings.message_types import message_classes

# Foxglove's numeric types by their number, as PointField's: both have eight, in another order.
POINT_FIELDS = {1: 2, 2: 1, 3: 4, 4: 3, 5: 6, 6: 5, 7: 7, 8: 8}
FLOATS: dict[int, np.dtype[Any]] = {7: np.dtype("<f4"), 8: np.dtype("<f8")}
MAXIMUM_FIELDS = 256


def _make(name: str, *values: object) -> Any:
    return message_classes()[name](*values)


def _header(fields: Fields, frame: str = "frame_id") -> Any:
    stamp = _make("builtin_interfaces/msg/Time", *time(fields))
    return _make("std_msgs/msg/Header", stamp, text(fields, frame))


def compressed_image(fields: Fields) -> Any:
    """CompressedImage."""
    form, data = text(fields, "format"), content(fields, "data")
    return _make("sensor_msgs/msg/CompressedImage", _header(fields), form, data)


def compressed_video(fields: Fields) -> Any:
    """CompressedVideo, which ROS has as foxglove_msgs/CompressedVideo."""
    header = _header(fields)
    return _make(
        "foxglove_msgs/msg/CompressedVideo",
        header.stamp,
        header.frame_id,
        content(fields, "data"),
        text(fields, "format"),
    )


def raw_image(fields: Fields) -> Any:
    """RawImage; its samples are little-endian."""
    return _make(
        "sensor_msgs/msg/Image",
        _header(fields),
        whole(fields, "height"),
        whole(fields, "width"),
        text(fields, "encoding"),
        0,
        whole(fields, "step"),
        content(fields, "data"),
    )


def camera_calibration(fields: Fields) -> Any:
    """CameraCalibration; where R and P are left out, the camera is no part of a stereo pair."""
    intrinsics = numbers(fields, "K", 9)
    rotation, projection = numbers(fields, "R", 0, 9), numbers(fields, "P", 0, 12)
    if not len(rotation):
        rotation = np.eye(3).reshape(-1)
    if not len(projection):
        projection = np.column_stack([intrinsics.reshape(3, 3), np.zeros(3)]).reshape(-1)
    return _make(
        "sensor_msgs/msg/CameraInfo",
        _header(fields),
        whole(fields, "height"),
        whole(fields, "width"),
        text(fields, "distortion_model"),
        numbers(fields, "D"),
        intrinsics,
        rotation,
        projection,
        0,
        0,
        _make("sensor_msgs/msg/RegionOfInterest", 0, 0, 0, 0, False),
    )


def frame_transform(fields: Fields) -> Any:
    """FrameTransform, as a message of one transform."""
    return _make("tf2_msgs/msg/TFMessage", [_transform(fields)])


def frame_transforms(fields: Fields) -> Any:
    """FrameTransforms."""
    edges = [_transform(edge) for edge in groups(fields, "transforms")]
    return _make("tf2_msgs/msg/TFMessage", edges)


def _transform(fields: Fields) -> Any:
    """Early versions of the schema had translation and rotation in a message of their own."""
    inner = group(fields, "transform") or fields
    return _make(
        "geometry_msgs/msg/TransformStamped",
        _header(fields, "parent_frame_id"),
        text(fields, "child_frame_id"),
        _make(
            "geometry_msgs/msg/Transform",
            _make("geometry_msgs/msg/Vector3", *_xyz(group(inner, "translation"))),
            _make("geometry_msgs/msg/Quaternion", *_xyzw(group(inner, "rotation"))),
        ),
    )


def pose_in_frame(fields: Fields) -> Any:
    """PoseInFrame."""
    pose = group(fields, "pose")
    position = _make("geometry_msgs/msg/Point", *_xyz(group(pose, "position")))
    orientation = _make("geometry_msgs/msg/Quaternion", *_xyzw(group(pose, "orientation")))
    return _make(
        "geometry_msgs/msg/PoseStamped",
        _header(fields),
        _make("geometry_msgs/msg/Pose", position, orientation),
    )


def laser_scan(fields: Fields) -> Any:
    """LaserScan; ValueError where its origin is not that of its frame."""
    if not _is_identity(fields):
        raise ValueError("a scan whose pose in its frame is not the identity is not read")
    ranges = numbers(fields, "ranges").astype(np.float32)
    start, end = number(fields, "start_angle"), number(fields, "end_angle")
    step = (end - start) / (len(ranges) - 1) if len(ranges) > 1 else 0.0
    intensities = numbers(fields, "intensities").astype(np.float32)
    return _make(
        "sensor_msgs/msg/LaserScan",
        _header(fields),
        *(start, end, step, 0.0, 0.0, 0.0, float("inf")),
        ranges,
        intensities,
    )


def point_cloud(fields: Fields) -> Any:
    """PointCloud; points are moved by its pose, so that they lie in its frame."""
    stride, data = whole(fields, "point_stride"), content(fields, "data")
    described = [
        (text(field, "name"), whole(field, "offset"), POINT_FIELDS.get(whole(field, "type"), 0))
        for field in groups(fields, "fields")[:MAXIMUM_FIELDS]
    ]
    if stride == 0 or len(data) % stride:
        raise ValueError(f"{len(data)} bytes are no points of {stride} bytes each")
    if not _is_identity(fields):
        data = _moved(data, stride, {name: (at, kind) for name, at, kind in described}, fields)
    return _make(
        "sensor_msgs/msg/PointCloud2",
        _header(fields),
        1,
        len(data) // stride,
        [_make("sensor_msgs/msg/PointField", *field, 1) for field in described],
        False,
        stride,
        len(data),
        data,
        False,
    )


def _moved(
    data: NDArray[np.uint8], stride: int, described: dict[str, tuple[int, int]], fields: Fields
) -> NDArray[np.uint8]:
    moved = data.copy()
    axes: list[NDArray[np.floating]] = []
    for name in ("x", "y", "z"):
        at, kind = described.get(name, (stride, 0))
        if kind not in FLOATS or at + FLOATS[kind].itemsize > stride:
            raise ValueError(f"a cloud with a pose has no field {name} of floats")
        axes.append(np.ndarray(len(data) // stride, FLOATS[kind], moved, at, (stride,)))
    points = np.stack([axis.astype(np.float64) for axis in axes], axis=-1)
    pose = group(fields, "pose")
    transform = Transform.from_quaternion(
        np.array(_xyz(group(pose, "position"))), np.array(_xyzw(group(pose, "orientation")))
    )
    for axis, values in zip(axes, transform.apply(points).T, strict=True):
        axis[...] = values
    return moved


def _is_identity(fields: Fields) -> bool:
    """Whether the pose of a cloud or scan moves nothing; a pose left out does not."""
    pose = group(fields, "pose")
    x, y, z, _ = _xyzw(group(pose, "orientation"))
    return _xyz(group(pose, "position")) == (0.0, 0.0, 0.0) and (x, y, z) == (0.0, 0.0, 0.0)


def _xyz(fields: Fields) -> tuple[float, float, float]:
    return number(fields, "x"), number(fields, "y"), number(fields, "z")


def _xyzw(fields: Fields) -> tuple[float, float, float, float]:
    """A quaternion; one that is left out altogether turns nothing."""
    return (*_xyz(fields), number(fields, "w", 0.0 if fields else 1.0))


Convert = Callable[[Fields], Any]
KINDS: dict[str, tuple[str, Convert]] = {
    "foxglove.CompressedImage": ("sensor_msgs/msg/CompressedImage", compressed_image),
    "foxglove.CompressedVideo": ("foxglove_msgs/msg/CompressedVideo", compressed_video),
    "foxglove.RawImage": ("sensor_msgs/msg/Image", raw_image),
    "foxglove.CameraCalibration": ("sensor_msgs/msg/CameraInfo", camera_calibration),
    "foxglove.FrameTransform": ("tf2_msgs/msg/TFMessage", frame_transform),
    "foxglove.FrameTransforms": ("tf2_msgs/msg/TFMessage", frame_transforms),
    "foxglove.PoseInFrame": ("geometry_msgs/msg/PoseStamped", pose_in_frame),
    "foxglove.LaserScan": ("sensor_msgs/msg/LaserScan", laser_scan),
    "foxglove.PointCloud": ("sensor_msgs/msg/PointCloud2", point_cloud),
}
