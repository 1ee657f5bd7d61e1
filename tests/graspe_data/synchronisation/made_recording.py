"""Small recordings of which everything is known: a drive, its sensors, and a robot's habits."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from graspe_data.geometry import Transform, quaternion_from_rotation, rotation_from_rpy
from graspe_data.recordings import RecordingWriter, open_recording
from graspe_data.recordings.message_types import message_classes
from graspe_data.recordings.writing import Container
from graspe_data.robot import Camera, Footprint, Intrinsics, Limits, Robot, Topics
from graspe_data.synchronisation.clocks import ClockSettings
from graspe_data.synchronisation.findings import Finding
from graspe_data.synchronisation.row_plan import SynchronisationSettings
from graspe_data.synchronisation.synchronised import SynchronisedRecording, synchronise

Floats = NDArray[np.float64]
Stamps = NDArray[np.int64]
Rate = Callable[[Floats], Floats]
Edge = tuple[int, str, str, Sequence[float], Sequence[float]]
"""Stamp in ns, parent, child, translation (3,), quaternion (4,)."""

SECOND = 1_000_000_000
START = 1_700_000_000 * SECOND
NO_TURN = (0.0, 0.0, 0.0, 1.0)
OPTICAL = (-0.5, 0.5, -0.5, 0.5)
"""A camera that looks ahead: z ahead, x to the right."""
LIDAR_AT, CAMERA_AT = (0.2, 0.0, 0.4), (0.3, 0.0, 0.3)

ROBOT = Robot(
    name="made",
    topics=Topics(image="/camera/image", points="/points", odometry="/odom"),
    camera=Camera(intrinsics=Intrinsics(width=4, height=3, fx=4, fy=4, cx=1.5, cy=1)),
    limits=Limits(linear_velocity=(-2, 2), yaw_rate=(-1.5, 1.5)),
    footprint=Footprint(length=1, width=0.6),
)
SHORT = SynchronisationSettings(history_steps=10, horizon_s=1.0)


@dataclass(frozen=True)
class Motion:
    """The truth at times (N,): pose of the body in the odometry frame, and its twist.

    ``position`` (N, 3), ``rotation`` (N, 3, 3), ``linear`` and ``angular`` (N, 3) in the body.
    """

    seconds: Floats
    position: Floats
    rotation: Floats
    linear: Floats
    angular: Floats

    @property
    def velocity(self) -> Floats:
        """Velocity along body x and yaw rate, (N, 2)."""
        return np.stack([self.linear[:, 0], self.angular[:, 2]], axis=1)

    def twist(self, frame: str = "body") -> Floats:
        """Linear and angular velocity (N, 6) in the body's frame, or in the fixed one."""
        if frame == "body":
            return np.concatenate([self.linear, self.angular], axis=1)
        turned = [np.einsum("nij,nj->ni", self.rotation, v) for v in (self.linear, self.angular)]
        return np.concatenate(turned, axis=1)

    def seen_as(self, child_in_base: Transform) -> Motion:
        """The motion of another frame on the same body."""
        offset, turn = child_in_base.translation, child_in_base.rotation
        linear = self.linear + np.cross(self.angular, offset)
        return replace(
            self,
            position=self.position + self.rotation @ offset,
            rotation=self.rotation @ turn,
            linear=linear @ turn,
            angular=self.angular @ turn,
        )

    def seen_from(self, fixed: Transform) -> Motion:
        """The same motion told in another fixed frame, ``fixed`` being the odometry frame in it."""
        return replace(
            self,
            position=self.position @ fixed.rotation.T + fixed.translation,
            rotation=fixed.rotation @ self.rotation,
        )


@dataclass(frozen=True)
class Drive:
    """A drive on a plane that may be tilted: velocity m/s and yaw rate rad/s by the second."""

    speed: Rate = lambda t: 0.6 + 0.3 * np.sin(0.7 * t)
    yaw_rate: Rate = lambda t: 0.2 * np.cos(0.5 * t)
    seconds: float = 9.0
    heading: float = 0.0
    start: tuple[float, float, float] = (0.0, 0.0, 0.0)
    slope: float = 0.0
    """Pitch of the plane, rad: positive leads down along x."""

    def at(self, seconds: Floats) -> Motion:
        """The truth, integrated in steps of a millisecond."""
        fine = np.arange(0.0, self.seconds + 0.5, 1e-3)
        speed, rate = self.speed(fine) + 0 * fine, self.yaw_rate(fine) + 0 * fine
        yaw = self.heading + _summed(rate, 1e-3)
        middle = 0.5 * (yaw[1:] + yaw[:-1])
        mean = 0.5 * (speed[1:] + speed[:-1]) * 1e-3
        way = np.zeros((fine.size, 2))
        way[1:] = np.cumsum(np.stack([mean * np.cos(middle), mean * np.sin(middle)], 1), axis=0)
        turn = np.interp(seconds, fine, yaw)
        plane = np.stack([*(np.interp(seconds, fine, axis) for axis in way.T), 0 * seconds], 1)
        tilt = rotation_from_rpy(0.0, self.slope, 0.0)
        zero = 0 * seconds
        return Motion(
            seconds,
            plane @ tilt.T + np.array(self.start),
            tilt @ np.array([rotation_from_rpy(0.0, 0.0, angle) for angle in turn.tolist()]),
            np.stack([np.interp(seconds, fine, speed), zero, zero], 1),
            np.stack([zero, zero, np.interp(seconds, fine, rate)], 1),
        )


def _summed(rate: Floats, step: float) -> Floats:
    return np.concatenate([[0.0], np.cumsum(0.5 * (rate[1:] + rate[:-1]) * step)])


STRAIGHT = Drive(speed=lambda t: 0.6 + 0 * t, yaw_rate=lambda t: 0 * t)
CURVES = Drive()
CIRCLE = Drive(speed=lambda t: 0.6 + 0 * t, yaw_rate=lambda t: 0.8 + 0 * t)
EIGHT = Drive(speed=lambda t: 0.8 + 0 * t, yaw_rate=lambda t: np.sin(np.pi * t / 4.5))
SPIN = Drive(speed=lambda t: 0 * t, yaw_rate=lambda t: 0.8 + 0 * t)
STANDING = Drive(speed=lambda t: 0 * t, yaw_rate=lambda t: 0 * t)
BACKWARDS = Drive(speed=lambda t: -0.5 + 0 * t, yaw_rate=lambda t: 0.1 + 0 * t)


class Make:
    """Messages of one recording; ``c`` are the classes, times int64 ns."""

    def __init__(self) -> None:
        """Begin without messages."""
        self.c: Any = message_classes()
        self.messages: list[tuple[str, Any, int]] = []

    def add(self, topic: str, message: Any, bag_ns: int) -> None:
        """Take one message as it comes to the recorder."""
        self.messages.append((topic, message, int(bag_ns)))

    def header(self, stamp_ns: int, frame: str) -> Any:
        """A header."""
        time = self.c["builtin_interfaces/msg/Time"](
            int(stamp_ns) // SECOND, int(stamp_ns) % SECOND
        )
        return self.c["std_msgs/msg/Header"](time, frame)

    def picture(self, stamp_ns: int, frame: str = "camera") -> Any:
        """Four by three pixels."""
        grey = np.zeros(12, np.uint8)
        kind = self.c["sensor_msgs/msg/Image"]
        return kind(self.header(stamp_ns, frame), 3, 4, "mono8", 0, 4, grey)

    def cloud(self, stamp_ns: int, frame: str = "lidar") -> Any:
        """One point, two metres ahead."""
        field = self.c["sensor_msgs/msg/PointField"]
        fields = [field(name, 4 * k, 7, 1) for k, name in enumerate("xyz")]
        data = np.array([2, 0, 0], "<f4").view(np.uint8)
        kind = self.c["sensor_msgs/msg/PointCloud2"]
        return kind(self.header(stamp_ns, frame), 1, 1, fields, False, 12, 12, data, True)

    def vector(self, values: Iterable[float], kind: str = "Vector3") -> Any:
        """A Vector3, or a Point."""
        return self.c[f"geometry_msgs/msg/{kind}"](*map(float, values))

    def quaternion(self, values: Iterable[float]) -> Any:
        """A quaternion, as it is."""
        return self.c["geometry_msgs/msg/Quaternion"](*map(float, values))

    def pose(self, position: Iterable[float], quaternion: Iterable[float]) -> Any:
        """A pose."""
        point, turn = self.vector(position, "Point"), self.quaternion(quaternion)
        return self.c["geometry_msgs/msg/Pose"](point, turn)

    def twist(self, values: Sequence[float]) -> Any:
        """A twist of six numbers."""
        return self.c["geometry_msgs/msg/Twist"](self.vector(values[:3]), self.vector(values[3:]))

    def odometry(
        self,
        stamp_ns: int,
        pose: Any,
        twist: Sequence[float],
        frames: tuple[str, str] = ("odom", "base_link"),
    ) -> Any:
        """A nav_msgs/Odometry."""
        nothing = np.zeros(36)
        return self.c["nav_msgs/msg/Odometry"](
            self.header(stamp_ns, frames[0]),
            frames[1],
            self.c["geometry_msgs/msg/PoseWithCovariance"](pose, nothing),
            self.c["geometry_msgs/msg/TwistWithCovariance"](self.twist(twist), nothing),
        )

    def edges(self, edges: Sequence[Edge]) -> Any:
        """A message of tf."""
        stamped, transform = (
            self.c[f"geometry_msgs/msg/{name}"] for name in ("TransformStamped", "Transform")
        )
        return self.c["tf2_msgs/msg/TFMessage"](
            [
                stamped(
                    self.header(stamp, parent), child, transform(self.vector(t), self.quaternion(q))
                )
                for stamp, parent, child, t, q in edges
            ]
        )

    def write(self, path: Path, container: Container = "mcap", *, sort: bool = True) -> Path:
        """Write all messages, by bag time or as they were added."""
        path = path.with_suffix(".bag") if container == "bag" else path
        messages = sorted(self.messages, key=lambda m: m[2]) if sort else self.messages
        with RecordingWriter(path, container) as writer:
            for topic, message, time_ns in messages:
                writer.write(topic, message, time_ns)
        return path


MOUNTINGS: tuple[Edge, ...] = (
    (START, "base_link", "lidar", LIDAR_AT, NO_TURN),
    (START, "base_link", "camera", CAMERA_AT, OPTICAL),
)


def times(seconds: float, rate: float) -> Floats:
    """Seconds from 0, at a rate."""
    return np.arange(0.0, seconds, 1 / rate)


def add_sensors(
    make: Make,
    seconds: float = 9.0,
    *,
    start_ns: int = START,
    bag_ns: int | None = None,
    frames: tuple[str, str] = ("camera", "lidar"),
    mountings: Sequence[Edge] = MOUNTINGS,
    clouds: bool = True,
    space: str = "",
) -> None:
    """Pictures and clouds ten times a second, 30 and 50 ms late, and the mountings.

    Args:
        make: The messages.
        seconds: How long.
        start_ns: The first stamp.
        bag_ns: When the recorder begins, the first stamp if None.
        frames: Of the camera and the lidar.
        mountings: Sent once on /tf_static; none for no such topic.
        clouds: Whether there are any.
        space: A namespace before all topics.
    """
    begin = start_ns if bag_ns is None else bag_ns
    if mountings:
        make.add(f"{space}/tf_static", make.edges(mountings), begin)
    for second in times(seconds, 10).tolist():
        since = round(second * SECOND)
        picture = make.picture(start_ns + since, frames[0])
        make.add(f"{space}/camera/image", picture, begin + since + 30_000_000)
        if clouds:
            cloud = make.cloud(start_ns + since, frames[1])
            make.add(f"{space}/points", cloud, begin + since + 50_000_000)


def add_odometry(
    make: Make,
    motion: Motion,
    twist: Floats | None = None,
    *,
    topic: str = "/odom",
    start_ns: int = START,
    bag_ns: int | None = None,
    frames: tuple[str, str] = ("odom", "base_link"),
    filled: bool = True,
) -> None:
    """Odometry messages of a motion, 2 ms late, with its own twist (N, 6) or another one."""
    told = motion.twist() if twist is None else twist
    quaternions = quaternion_from_rotation(motion.rotation)
    begin = start_ns if bag_ns is None else bag_ns
    for k, second in enumerate(motion.seconds.tolist()):
        since = round(second * SECOND)
        given = (motion.position[k], quaternions[k]) if filled else ((0, 0, 0), (0, 0, 0, 0))
        message = make.odometry(start_ns + since, make.pose(*given), told[k].tolist(), frames)
        make.add(topic, message, begin + since + 2_000_000)


def add_edge(
    make: Make,
    motion: Motion,
    frames: tuple[str, str] = ("odom", "base_link"),
    *,
    topic: str = "/tf",
    start_ns: int = START,
    bag_ns: int | None = None,
    late_ns: int = 2_000_000,
) -> None:
    """A moving edge of tf."""
    quaternions = quaternion_from_rotation(motion.rotation)
    begin = start_ns if bag_ns is None else bag_ns
    for k, second in enumerate(motion.seconds.tolist()):
        since = round(second * SECOND)
        edge = (start_ns + since, *frames, motion.position[k].tolist(), quaternions[k].tolist())
        make.add(topic, make.edges([edge]), begin + since + late_ns)


def drive(
    way: Drive = CURVES, rate: float = 50.0, twist: str = "body", **sensors: Any
) -> tuple[Make, Motion]:
    """A sound recording of a drive, but for the frame of its twist; and the truth."""
    make, motion = Make(), way.at(times(way.seconds, rate))
    add_sensors(make, way.seconds, **sensors)
    add_odometry(make, motion, motion.twist(twist))
    return make, motion


def robot(**changes: Any) -> Robot:
    """The robot with some fields changed; topics, limits and frames by name."""
    named = ("image", "points", "odometry", "command")
    topics = {name: changes.pop(name) for name in named if name in changes}
    if topics:
        changes["topics"] = ROBOT.topics.model_copy(update=topics)
    return ROBOT.model_copy(update=changes)


def synchronised(
    path: Path,
    of: Robot = ROBOT,
    settings: SynchronisationSettings = SHORT,
    told: list[Finding] | None = None,
) -> SynchronisedRecording:
    """Read a recording and plan its rows."""
    with open_recording(path) as recording:
        return synchronise(recording, of, ClockSettings(), settings, told)


def kinds(found: SynchronisedRecording) -> list[str]:
    """The kinds of what was found, in order."""
    return [finding.kind for finding in found.findings]


def worst(found: SynchronisedRecording, way: Drive, start_ns: int = START) -> float:
    """The largest error of velocities of a recording, m/s or rad/s, against the truth."""
    seconds = (found.odometry.stamps_ns - start_ns) / SECOND
    return float(np.abs(found.odometry.velocity - way.at(seconds).velocity).max())
