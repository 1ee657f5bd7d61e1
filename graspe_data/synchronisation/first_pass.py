"""The first pass over a recording: every stamp, every motion sample, calibration and frames."""

from __future__ import annotations

from array import array
from collections import Counter
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from graspe_data.errors import GeometryError, RecordingError
from graspe_data.geometry import FrameTree, Transform, plain_frame
from graspe_data.recordings.decoding import (
    decode_calibration,
    decode_inertial,
    decode_motion,
    decode_transforms,
)
from graspe_data.recordings.messages import Loss, RawMessage
from graspe_data.recordings.recording import Recording
from graspe_data.robot import Robot, Topics
from graspe_data.sensor_data import CameraCalibration, Motion
from graspe_data.synchronisation.differentiate import body_velocities
from graspe_data.synchronisation.tracks import InertialTrack, MotionTrack, StampTrack, Tracks

TF_TYPES = ("tf2_msgs/msg/TFMessage", "tf/msg/tfMessage")


@dataclass
class _Collector:
    """Grows typed arrays while the pass runs; a message costs some tens of bytes."""

    header: array[int] = field(default_factory=lambda: array("q"))
    bag: array[int] = field(default_factory=lambda: array("q"))
    ordinal: array[int] = field(default_factory=lambda: array("q"))
    values: array[float] = field(default_factory=lambda: array("d"))
    headless: bool = False
    seen: int = 0

    def add(self, stamp_ns: int | None, bag_time_ns: int, *values: float) -> None:
        self.headless |= stamp_ns is None
        self.ordinal.append(self.seen - 1)
        self.header.append(stamp_ns or 0)
        self.bag.append(bag_time_ns)
        self.values.extend(values)

    def stamps(self, topic: str) -> StampTrack:
        header = None if self.headless else np.array(self.header, np.int64)
        bag, ordinal = np.array(self.bag, np.int64), np.array(self.ordinal, np.int64)
        return StampTrack(topic, header, bag, ordinal)

    def table(self, width: int) -> NDArray[np.float64]:
        return np.array(self.values, np.float64).reshape(-1, width)


class _Pass:
    """One pass: routes each message to its collector and counts what does not decode."""

    def __init__(self, recording: Recording, robot: Robot) -> None:
        self.recording, self.robot = recording, robot
        self.sensors = {topic: _Collector() for topic in _served(robot.topics)}
        self.edges: dict[tuple[str, str], Transform] = {}
        self.calibration: CameraCalibration | None = None
        self.imu_frame = ""
        self.odometry_child = ""
        self.broken: Counter[str] = Counter()
        self.faults: dict[str, str] = {}

    def run(self) -> None:
        transform_topics = {
            name
            for name, info in self.recording.topics.items()
            if info.message_type in TF_TYPES
            and (name.endswith("static") or name == self.robot.topics.odometry)
        }
        wanted = {*self.sensors, *transform_topics, self.robot.topics.camera_info or ""}
        for raw in self.recording.messages(wanted & self.recording.topics.keys()):
            if raw.topic in self.sensors:
                self.sensors[raw.topic].seen += 1
            try:
                self._take(raw)
            except (RecordingError, GeometryError) as error:
                self.broken[raw.topic] += 1
                self.faults.setdefault(raw.topic, str(error))

    def _take(self, raw: RawMessage) -> None:
        topics = self.robot.topics
        kind = self.recording.topics[raw.topic].message_type
        if raw.topic in (topics.image, topics.points):
            self._add_stamp(raw)
        elif kind in TF_TYPES:
            self._take_transforms(raw)
        elif raw.topic == topics.camera_info:
            if self.calibration is None:
                self.calibration = decode_calibration(
                    self.recording.decode(raw), raw.topic, rectified=self.robot.camera.rectified
                )
        elif raw.topic == topics.imu:
            sample = decode_inertial(self.recording.decode(raw), raw.topic)
            self.imu_frame = sample.frame
            values = (*sample.angular_velocity, *sample.linear_acceleration)
            self.sensors[raw.topic].add(sample.stamp_ns, raw.bag_time_ns, *values)
        else:
            motion = decode_motion(self.recording.decode(raw), kind, raw.topic)
            if raw.topic == topics.odometry:
                self.odometry_child = plain_frame(motion.child_frame)
            self._add_motion(raw, motion)

    def _add_stamp(self, raw: RawMessage) -> None:
        stamp_ns = self.recording.header_stamp_ns(raw)
        if stamp_ns is None:
            raise RecordingError(f"{len(raw.data)} bytes hold no header stamp.")
        self.sensors[raw.topic].add(stamp_ns, raw.bag_time_ns)

    def _take_transforms(self, raw: RawMessage) -> None:
        robot = self.robot
        for edge in decode_transforms(self.recording.decode(raw)):
            parent, child = plain_frame(edge.parent), plain_frame(edge.child)
            if raw.topic != robot.topics.odometry:
                translation, quaternion = np.array(edge.translation), np.array(edge.quaternion)
                self.edges[parent, child] = Transform.from_quaternion(translation, quaternion)
            elif (parent, child) == (robot.odometry_frame, robot.base_frame):
                stamp, pose = edge.stamp_ns, (*edge.translation, *edge.quaternion)
                self.sensors[raw.topic].add(stamp, raw.bag_time_ns, *pose, np.nan, np.nan)

    def _add_motion(self, raw: RawMessage, motion: Motion) -> None:
        nan = float("nan")
        self.sensors[raw.topic].add(
            motion.stamp_ns,
            raw.bag_time_ns,
            *(motion.position or (nan,) * 3),
            *(motion.quaternion or (nan,) * 4),
            nan if motion.linear_velocity is None else motion.linear_velocity,
            nan if motion.yaw_rate is None else motion.yaw_rate,
        )

    def motion(self, topic: str | None) -> MotionTrack | None:
        if topic is None or not self.sensors[topic].bag:
            return None
        stamps, table = self.sensors[topic].stamps(topic), self.sensors[topic].table(9)
        return MotionTrack(stamps, table[:, :3], table[:, 3:7], table[:, 7:9])

    def inertial(self, topic: str | None) -> InertialTrack | None:
        if topic is None or not self.sensors[topic].bag:
            return None
        table = self.sensors[topic].table(6)
        stamps = self.sensors[topic].stamps(topic)
        return InertialTrack(stamps, self.imu_frame, table[:, :3], table[:, 3:])

    def losses(self) -> tuple[Loss, ...]:
        undecoded = [
            Loss(f"does not decode; the first: {self.faults[topic]}", topic, count)
            for topic, count in sorted(self.broken.items())
        ]
        topics = self.robot.topics
        optional = {"command": topics.command, "imu": topics.imu}
        absent = [
            Loss(f"named as {role} in the robot manifest, not in the recording", topic)
            for role, topic in optional.items()
            if topic is not None and topic not in self.recording.topics
        ]
        return (*self.recording.losses, *undecoded, *absent)


def read_tracks(recording: Recording, robot: Robot) -> Tracks:
    """Read every stamp and motion sample of the topics that a robot declares.

    Raises:
        RecordingError: A topic that a row needs is absent or empty; the text lists the topics of
            the recording and what each could be.
    """
    _require_topics(recording, robot.topics)
    reading = _Pass(recording, robot)
    reading.run()
    topics = robot.topics
    _check_odometry_frame(reading.odometry_child, robot, FrameTree(reading.edges))
    odometry = reading.motion(topics.odometry)
    empty = [name for name in (topics.image, topics.points) if not reading.sensors[name].bag]
    if odometry is None or empty:
        names = ", ".join([*empty, *([] if odometry else [topics.odometry])])
        raise RecordingError(f"{recording.path}: no readable message on {names}.")
    return Tracks(
        image=reading.sensors[topics.image].stamps(topics.image),
        points=reading.sensors[topics.points].stamps(topics.points),
        odometry=_with_velocity(odometry, robot),
        command=reading.motion(topics.command),
        imu=reading.inertial(topics.imu),
        calibration=reading.calibration,
        frames=FrameTree(reading.edges),
        losses=reading.losses(),
    )


def _served(topics: Topics) -> list[str]:
    served = (topics.image, topics.points, topics.odometry, topics.command, topics.imu)
    return [topic for topic in served if topic]


def _require_topics(recording: Recording, topics: Topics) -> None:
    if not recording.topics:
        raise RecordingError(f"{recording.path}: no messages.")
    needed = {"image": topics.image, "points": topics.points, "odometry": topics.odometry}
    missing = [f"{use} {name}" for use, name in needed.items() if name not in recording.topics]
    if missing:
        present = ", ".join(f"{t.name} [{t.message_type}]" for t in recording.topics.values())
        raise RecordingError(
            f"{recording.path}: lacks the topics of the robot manifest: {', '.join(missing)}. "
            f"It holds: {present}. Correct `topics` in the robot manifest, or start from "
            f"`graspe scaffold`."
        )


def _check_odometry_frame(child: str, robot: Robot, frames: FrameTree) -> None:
    """Refuse odometry of a frame that tf_static places elsewhere than base_link."""
    base = plain_frame(robot.base_frame)
    if not child or child == base or not {child, base} <= set(frames.frames):
        return
    offset = frames.lookup(base, child)
    if np.allclose(offset.rotation, np.eye(3)) and np.allclose(offset.translation, 0):
        return
    raise RecordingError(
        f"{robot.topics.odometry}: odometry of the frame {child!r}, which tf_static places at "
        f"{np.round(offset.translation, 3).tolist()} m in {base!r}. Name odometry of {base!r} "
        f"under `topics.odometry`, or set `base_frame: {child}` and mount the sensors in it."
    )


def _with_velocity(track: MotionTrack, robot: Robot) -> MotionTrack:
    """Differentiate the poses where that is asked for, or where the type carries no twist.

    The time between poses is that of the clock which the robot manifest chooses.
    """
    reported = not np.isnan(track.velocity).all()
    unposed = np.isnan(track.position).all()
    if unposed or (reported and robot.odometry_velocity == "reported"):
        return track
    clock = track.stamps.header_ns
    if clock is None or robot.clocks.odometry.stamp == "bag":
        clock = track.stamps.bag_ns
    order = np.argsort(clock, kind="stable")
    velocity = np.empty_like(track.velocity)
    linear, yaw_rate = body_velocities(clock[order], track.position[order], track.quaternion[order])
    velocity[order] = np.stack([linear, yaw_rate], axis=1)
    return MotionTrack(track.stamps, track.position, track.quaternion, velocity)
