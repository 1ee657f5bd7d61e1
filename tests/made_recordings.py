"""Small recordings of a known drive, every value computed here; cases depart from them."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from graspe_data.recordings import RecordingWriter
from graspe_data.recordings.message_types import message_classes
from graspe_data.recordings.writing import Container

SECOND = 1_000_000_000
START = 1_700_000_000 * SECOND
OPTICAL = (-0.5, 0.5, -0.5, 0.5)
STRAIGHT = (0.0, 0.0, 0.0, 1.0)
IMAGE, CLOUD, ODOMETRY = "/camera/image_raw", "/velodyne_points", "/odom"
INFO, COMMAND, TF, STATIC = "/camera/camera_info", "/cmd_vel", "/tf", "/tf_static"

Entry = tuple[str, Any, int]
Edge = tuple[str, str, tuple[float, float, float], tuple[float, ...]]
TYPES: Any = message_classes()
MOUNTINGS: tuple[Edge, ...] = (
    ("base_link", "lidar", (0.2, 0.0, 0.4), STRAIGHT),
    ("base_link", "cam", (0.3, 0.0, 0.3), OPTICAL),
)


@dataclass(frozen=True)
class Pose:
    """Where the robot is, by closed form: an arc of one radius, or a straight line."""

    x: float
    y: float
    yaw: float


@dataclass(frozen=True)
class Drive:
    """A drive at constant speed, m/s, and yaw rate, rad/s, from a heading in rad."""

    v: float = 0.6
    omega: float = 0.2
    heading: float = 0.5
    seconds: float = 12.0

    def at(self, time_s: float) -> Pose:
        """The pose at a time."""
        yaw = self.heading + self.omega * time_s
        if self.omega == 0:
            way = self.v * time_s
            return Pose(way * math.cos(yaw), way * math.sin(yaw), yaw)
        radius = self.v / self.omega
        return Pose(
            radius * (math.sin(yaw) - math.sin(self.heading)),
            radius * (math.cos(self.heading) - math.cos(yaw)),
            yaw,
        )


def stamp(time_ns: int) -> Any:
    return TYPES["builtin_interfaces/msg/Time"](time_ns // SECOND, time_ns % SECOND)


def header(time_ns: int, frame: str) -> Any:
    return TYPES["std_msgs/msg/Header"](stamp(time_ns), frame)


def vector(x: float, y: float, z: float) -> Any:
    return TYPES["geometry_msgs/msg/Vector3"](float(x), float(y), float(z))


def turned(yaw: float) -> Any:
    return TYPES["geometry_msgs/msg/Quaternion"](0.0, 0.0, math.sin(yaw / 2), math.cos(yaw / 2))


def twist(linear: tuple[float, float], yaw_rate: float) -> Any:
    return TYPES["geometry_msgs/msg/Twist"](vector(*linear, 0), vector(0, 0, yaw_rate))


def odometry(
    time_ns: int,
    pose: Pose,
    linear: tuple[float, float],
    yaw_rate: float,
    frames: tuple[str, str] = ("odom", "base_link"),
) -> Any:
    place = TYPES["geometry_msgs/msg/Point"](pose.x, pose.y, 0.0)
    posed = TYPES["geometry_msgs/msg/Pose"](place, turned(pose.yaw))
    with_pose = TYPES["geometry_msgs/msg/PoseWithCovariance"](posed, np.zeros(36))
    moving = TYPES["geometry_msgs/msg/TwistWithCovariance"](twist(linear, yaw_rate), np.zeros(36))
    head = header(time_ns, frames[0])
    return TYPES["nav_msgs/msg/Odometry"](head, frames[1], with_pose, moving)


def transforms(time_ns: int, edges: Iterable[Edge]) -> Any:
    made = []
    for parent, child, place, quaternion in edges:
        turn = TYPES["geometry_msgs/msg/Quaternion"](*map(float, quaternion))
        moved = TYPES["geometry_msgs/msg/Transform"](vector(*place), turn)
        head = header(time_ns, parent)
        made.append(TYPES["geometry_msgs/msg/TransformStamped"](head, child, moved))
    return TYPES["tf2_msgs/msg/TFMessage"](made)


def picture(time_ns: int, number: int, frame: str = "cam") -> Any:
    rgb = np.full((48, 64, 3), number % 256, np.uint8)
    rgb[:, :32, 0] = 200
    head = header(time_ns, frame)
    return TYPES["sensor_msgs/msg/Image"](head, 48, 64, "rgb8", 0, 192, rgb.reshape(-1))


def calibration(time_ns: int, frame: str = "cam", size: tuple[int, int] = (64, 48)) -> Any:
    matrix = np.array([60.0, 0, 31.5, 0, 60, 23.5, 0, 0, 1])
    projection = np.insert(matrix.reshape(3, 3), 3, 0, axis=1).reshape(-1)
    roi = TYPES["sensor_msgs/msg/RegionOfInterest"](0, 0, 0, 0, False)
    eye, none = np.eye(3).reshape(-1), np.zeros(5)
    info = TYPES["sensor_msgs/msg/CameraInfo"]
    head, (width, height) = header(time_ns, frame), size
    return info(head, height, width, "plumb_bob", none, matrix, eye, projection, 0, 0, roi)


def room(height: float = 0.9) -> np.ndarray[tuple[int], np.dtype[np.void]]:
    """Sixteen rings of returns from a round wall at 8 m and the ground below the lidar."""
    kind = np.dtype([(name, "<f4") for name in ("x", "y", "z", "intensity")] + [("ring", "<u2")])
    elevation = np.deg2rad(np.linspace(-15, 15, 16))
    azimuth = np.linspace(-np.pi, np.pi, 180, endpoint=False)
    across, around = np.meshgrid(elevation, azimuth)
    far = 8.0 / np.cos(across)
    below = np.where(across < 0, height / np.maximum(np.sin(-across), 1e-3), np.inf)
    distance = np.minimum(far, below)
    points = np.zeros(across.size, kind)
    points["x"] = (distance * np.cos(across) * np.cos(around)).ravel()
    points["y"] = (distance * np.cos(across) * np.sin(around)).ravel()
    points["z"] = (distance * np.sin(across)).ravel()
    points["intensity"] = 80
    points["ring"] = np.tile(np.arange(16), 180)
    return points


def cloud(time_ns: int, points: np.ndarray[Any, Any] | None = None, frame: str = "lidar") -> Any:
    points = room() if points is None else points
    codes = {"<f4": 7, "<u2": 4}
    fields = [
        TYPES["sensor_msgs/msg/PointField"](name, form[1], codes[form[0].str], 1)
        for name, form in (points.dtype.fields or {}).items()
    ]
    step, data = points.dtype.itemsize, np.frombuffer(points.tobytes(), np.uint8)
    head = header(time_ns, frame)
    kind = TYPES["sensor_msgs/msg/PointCloud2"]
    return kind(head, 1, points.size, fields, False, step, step * points.size, data, True)


@dataclass
class MadeRecording:
    """A sound recording of a drive; a case adds, drops or changes messages."""

    drive: Drive = field(default_factory=Drive)
    mountings: tuple[Edge, ...] = MOUNTINGS
    entries: list[Entry] = field(default_factory=list)

    def __post_init__(self) -> None:
        """Begin with all sensors, unless entries are given."""
        if not self.entries:
            self.entries = sorted(self._sound(), key=lambda entry: entry[2])

    def _sound(self) -> Iterator[Entry]:
        yield STATIC, transforms(START, self.mountings), START
        for number in range(round(self.drive.seconds * 10)):
            time_ns = START + number * SECOND // 10
            yield IMAGE, picture(time_ns, number), time_ns + 30_000_000
            yield INFO, calibration(time_ns), time_ns + 30_000_000
            yield CLOUD, cloud(time_ns), time_ns + 50_000_000
            yield COMMAND, twist((self.drive.v, 0.0), self.drive.omega), time_ns
        for time_ns in self.times(50):
            pose, drive = self.pose(time_ns), self.drive
            message = odometry(time_ns, pose, (drive.v, 0.0), drive.omega)
            yield ODOMETRY, message, time_ns + 2_000_000

    def times(self, rate: int) -> Iterator[int]:
        """Stamps at a rate, ns."""
        for number in range(round(self.drive.seconds * rate)):
            yield START + number * SECOND // rate

    def pose(self, time_ns: int) -> Pose:
        """The robot's pose at a stamp."""
        return self.drive.at((time_ns - START) / SECOND)

    def without(self, *topics: str) -> MadeRecording:
        """The same without some topics."""
        kept = [entry for entry in self.entries if entry[0] not in topics]
        return MadeRecording(self.drive, self.mountings, kept)

    def plus(self, entries: Iterable[Entry]) -> MadeRecording:
        """The same with more messages."""
        return MadeRecording(self.drive, self.mountings, [*self.entries, *entries])

    def changed(self, topic: str, change: Callable[[Any], Any]) -> MadeRecording:
        """The same with the messages of one topic changed; None leaves one out."""
        made = []
        for name, message, bag_ns in self.entries:
            now = change(message) if name == topic else message
            if now is not None:
                made.append((name, now, bag_ns))
        return MadeRecording(self.drive, self.mountings, made)

    def write(self, path: Path, container: Container = "mcap", *, in_time: bool = True) -> Path:
        """Write it, in the order of bag time or of the entries."""
        entries = sorted(self.entries, key=lambda e: e[2]) if in_time else self.entries
        with RecordingWriter(path, container) as writer:
            for entry in entries:
                writer.write(*entry)
        return path


def time_of(message: Any) -> int:
    """The header stamp of a message, ns."""
    return int(message.header.stamp.sec) * SECOND + int(message.header.stamp.nanosec)
