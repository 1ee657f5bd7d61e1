"""Twelve seconds of camera, lidar and odometry, whose messages are known."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from graspe_data.recordings import RecordingWriter
from graspe_data.recordings.identity import (
    Kind,
)
from graspe_data.recordings.message_types import message_classes
from graspe_data.recordings.writing import Compression, Container

CLASSES: Any = message_classes()
SECOND = 1_000_000_000
START = 1_700_000_000 * SECOND
LENGTH_S = 12.0
TOPICS: dict[str, Kind] = {"/camera": "image", "/lidar": "points", "/odom": "odometry"}
Message = tuple[str, int, object]


def header(stamp_ns: int) -> object:
    stamp = CLASSES["builtin_interfaces/msg/Time"](stamp_ns // SECOND, stamp_ns % SECOND)
    return CLASSES["std_msgs/msg/Header"](stamp, "frame")


def image(stamp_ns: int, random: np.random.Generator, *, dark: bool) -> object:
    data = np.zeros(30 * 40 * 3, np.uint8) if dark else random.integers(0, 90, 3600, np.uint8)
    return CLASSES["sensor_msgs/msg/Image"](header(stamp_ns), 30, 40, "rgb8", 0, 120, data)


def cloud(stamp_ns: int, random: np.random.Generator) -> object:
    field = CLASSES["sensor_msgs/msg/PointField"]
    fields = [field(name, 4 * n, 7, 1) for n, name in enumerate("xyz")]
    data = random.normal(5, 2, (500, 3)).astype(np.float32).view(np.uint8).ravel()
    return CLASSES["sensor_msgs/msg/PointCloud2"](
        header(stamp_ns), 1, 500, fields, False, 12, 6000, data, True
    )


def odometry(stamp_ns: int, along: float, speed: float) -> object:
    point, quaternion = CLASSES["geometry_msgs/msg/Point"], CLASSES["geometry_msgs/msg/Quaternion"]
    vector, covariance = CLASSES["geometry_msgs/msg/Vector3"], np.zeros(36)
    pose = CLASSES["geometry_msgs/msg/Pose"](point(along, 0.0, 0.0), quaternion(0.0, 0.0, 0.0, 1.0))
    twist = CLASSES["geometry_msgs/msg/Twist"](vector(speed, 0.0, 0.0), vector(0.0, 0.0, 0.0))
    return CLASSES["nav_msgs/msg/Odometry"](
        header(stamp_ns),
        "base_link",
        CLASSES["geometry_msgs/msg/PoseWithCovariance"](pose, covariance),
        CLASSES["geometry_msgs/msg/TwistWithCovariance"](twist, covariance),
    )


def drive(
    seed: int = 0,
    speed: float = 0.6,
    *,
    dark: bool = False,
    same_clouds: bool = False,
    same_pictures: bool = False,
) -> list[Message]:
    """Twelve seconds at 10 Hz (odometry 50 Hz); all drives have the same stamps."""
    clouds = np.random.default_rng(99 if same_clouds else seed)
    pictures = np.random.default_rng(77 if same_pictures else seed + 500)
    messages: list[Message] = []
    for number in range(int(LENGTH_S * 10)):
        stamp = START + number * SECOND // 10
        messages.append(("/camera", stamp + 3_000_000, image(stamp, pictures, dark=dark)))
        messages.append(("/lidar", stamp + 50_000_000, cloud(stamp, clouds)))
    for number in range(int(LENGTH_S * 50)):
        stamp, along = START + number * SECOND // 50, speed * number / 50
        messages.append(("/odom", stamp + 1_000_000, odometry(stamp, along, speed)))
    return sorted(messages, key=lambda message: message[1])


def between(messages: Iterable[Message], start_s: float, stop_s: float) -> list[Message]:
    start, stop = (START + round(second * SECOND) for second in (start_s, stop_s))
    return [message for message in messages if start <= message[1] < stop]


def write(
    path: Path,
    messages: Iterable[Message],
    container: Container = "mcap",
    compression: Compression = "none",
    prefix: str = "",
) -> Path:
    with RecordingWriter(path, container, compression) as writer:
        for topic, time_ns, message in messages:
            writer.write(prefix + topic, message, time_ns)
    return path
