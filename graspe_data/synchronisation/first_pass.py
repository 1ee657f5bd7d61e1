"""The first pass over a recording: every stamp, every motion sample, calibration and edges."""

from __future__ import annotations

from collections import Counter
from typing import Any

from graspe_data.errors import GeometryError, RecordingError
from graspe_data.geometry import plain_frame
from graspe_data.recordings.decoding import (
    decode_calibration,
    decode_image,
    decode_inertial,
    decode_motion,
    decode_transforms,
)
from graspe_data.recordings.decoding.lidars.cloud_source import CloudMessage, CloudSource
from graspe_data.recordings.identity import ContentObserver
from graspe_data.recordings.messages import Damage, RawMessage
from graspe_data.recordings.recording import Recording
from graspe_data.robot import BY_LIDAR, Robot, Topics
from graspe_data.sensor_data import CameraCalibration, Motion
from graspe_data.synchronisation.collectors import Collector
from graspe_data.synchronisation.tracks import InertialTrack, MotionTrack, Tracks
from graspe_data.synchronisation.transform_topics import (
    TF_TYPES,
    EdgeReader,
    transform_topics,
)

_NAN = float("nan")
_MOTION_WIDTH, _INERTIAL_WIDTH = 13, 6


def read_tracks(recording: Recording, robot: Robot) -> Tracks:
    """Read every stamp and motion sample of the topics that a robot declares.

    Raises:
        RecordingError: A topic that a row needs is absent or empty; the text lists the topics of
            the recording.
    """
    _require_topics(recording, robot.topics)
    reading = _Pass(recording, robot)
    reading.run()
    return reading.tracks()


class _Pass:
    """One pass: routes each message to its collector and counts what does not decode."""

    def __init__(self, recording: Recording, robot: Robot) -> None:
        self.recording, self.robot = recording, robot
        topics = robot.topics
        self.by_tf = not robot.by_lidar and _is_tf(recording, topics.odometry)
        widths = {
            topics.image: 0,
            topics.points: 0,
            topics.command: _MOTION_WIDTH,
            topics.imu: _INERTIAL_WIDTH,
        }
        if not (self.by_tf or robot.by_lidar):
            widths[topics.odometry] = _MOTION_WIDTH
        self.sensors = {topic: Collector(width) for topic, width in widths.items() if topic}
        self.clouds = CloudSource(recording, topics.points, robot.lidar)
        self.frames: dict[str, str] = {}
        self.child_frames: dict[str, str] = {}
        self.edges = EdgeReader(_known_frames(robot))
        self.calibration: CameraCalibration | None = None
        self.picture_size: tuple[int, int] | None = None
        self.broken: Counter[str] = Counter()
        self.faults: dict[str, str] = {}
        self.content = ContentObserver(
            recording.decode,
            {topics.odometry: "odometry", topics.image: "image", topics.points: "points"},
            {topic.name: topic.message_type for topic in recording.topics.values()},
        )

    def run(self) -> None:
        topics = self.robot.topics
        own = transform_topics(
            self.recording.topics, [topics.image, topics.points, topics.odometry]
        )
        for_tf = {topics.odometry} if self.by_tf else set()
        wanted = {*self.sensors, *own, *for_tf, topics.camera_info or ""}
        for raw in self.recording.messages(wanted & self.recording.topics.keys()):
            if raw.topic in self.sensors and raw.topic != topics.points:
                self.sensors[raw.topic].seen += 1
            try:
                self._take(raw)
                if self.content.watches(raw.topic):
                    self.content.observe(raw, self.recording.header_stamp_ns(raw))
            except (RecordingError, GeometryError) as error:
                self.broken[raw.topic] += 1
                self.faults.setdefault(raw.topic, str(error))
        if cloud := self.clouds.rest():
            self._add_cloud(cloud)

    def _take(self, raw: RawMessage) -> None:
        topics = self.robot.topics
        kind = self.recording.topics[raw.topic].message_type
        if raw.topic == topics.image:
            self._add_picture(raw)
        elif raw.topic == topics.points:
            if cloud := self.clouds.take(raw):
                self._add_cloud(cloud)
        elif kind in TF_TYPES:
            self.edges.take(raw, decode_transforms(self.recording.decode(raw)))
        elif raw.topic == topics.camera_info:
            self._take_calibration(raw)
        elif raw.topic == topics.imu:
            self._add_inertial(raw)
        else:
            self._add_motion(raw, decode_motion(self.recording.decode(raw), kind, raw.topic))

    def _add_cloud(self, cloud: CloudMessage) -> None:
        collector = self.sensors[cloud.topic]
        collector.seen += 1
        if cloud.stamp_ns is None and not self.clouds.joins:
            raise RecordingError("its bytes hold no header stamp.")
        collector.add(
            cloud.stamp_ns, RawMessage(cloud.topic, cloud.bag_time_ns, b"", cloud.position)
        )
        if cloud.topic not in self.frames:
            self._note_frame(cloud.topic, cloud.frame())

    def _add_picture(self, raw: RawMessage) -> None:
        stamp_ns = self.recording.header_stamp_ns(raw)
        if stamp_ns is None:
            raise RecordingError(f"{len(raw.data)} bytes hold no header stamp.")
        self.sensors[raw.topic].add(stamp_ns, raw)
        if raw.topic not in self.frames:
            message: Any = self.recording.decode(raw)
            header = getattr(message, "header", message)
            self._note_frame(raw.topic, getattr(header, "frame_id", ""))
            self.picture_size = self._size_of(message, raw.topic)

    def _size_of(self, message: Any, topic: str) -> tuple[int, int] | None:
        kind = self.recording.topics[topic].message_type
        try:
            height, width, _ = decode_image(message, kind, topic).rgb.shape
        except RecordingError:
            return None
        return width, height

    def _note_frame(self, topic: str, frame: str) -> None:
        self.frames.setdefault(topic, plain_frame(frame))
        self.edges.targets.add(plain_frame(frame))

    def _take_calibration(self, raw: RawMessage) -> None:
        if self.calibration is None:
            rectified = self.robot.camera.rectified
            message: Any = self.recording.decode(raw)
            self.calibration = decode_calibration(message, raw.topic, rectified=rectified)
            self.frames.setdefault(raw.topic, plain_frame(message.header.frame_id))

    def _add_inertial(self, raw: RawMessage) -> None:
        sample = decode_inertial(self.recording.decode(raw), raw.topic)
        self.frames.setdefault(raw.topic, sample.frame)
        values = (*sample.angular_velocity, *sample.linear_acceleration)
        self.sensors[raw.topic].add(sample.stamp_ns, raw, *values)

    def _add_motion(self, raw: RawMessage, motion: Motion) -> None:
        self._note_frame(raw.topic, motion.frame)
        if motion.child_frame:
            self.child_frames.setdefault(raw.topic, plain_frame(motion.child_frame))
            self.edges.targets.add(plain_frame(motion.child_frame))
        self.sensors[raw.topic].add(
            motion.stamp_ns,
            raw,
            *(motion.position or (_NAN,) * 3),
            *(motion.quaternion or (_NAN,) * 4),
            *(motion.twist or (_NAN,) * 6),
        )

    def tracks(self) -> Tracks:
        topics = self.robot.topics
        edges, odometry = self.edges.tracks(), self._motion(topics.odometry)
        empty = [name for name in (topics.image, topics.points) if not self.sensors[name].bag]
        if odometry is None and not (self.robot.by_lidar or (self.by_tf and edges)):
            empty.append(topics.odometry)
        if empty:
            raise RecordingError(self._empty(empty))
        return Tracks(
            image=self.sensors[topics.image].stamps(topics.image),
            points=self.sensors[topics.points].stamps(topics.points),
            odometry=odometry,
            command=self._motion(topics.command),
            imu=self._inertial(topics.imu),
            calibration=self.calibration,
            edges=edges,
            image_frame=self.frames.get(topics.image, ""),
            points_frame=self.frames.get(topics.points, ""),
            losses=self._losses(),
            camera_info_frame=self.frames.get(topics.camera_info or "", ""),
            picture_size=self.picture_size,
            unusable_edges=self.edges.faults(),
            lidar_notes=self.clouds.notes,
            content=self.content.result(),
        )

    def _motion(self, topic: str | None) -> MotionTrack | None:
        collected = self.sensors.get(topic or "")
        if topic is None or collected is None or not collected.bag:
            return None
        table = collected.table()
        return MotionTrack(
            collected.stamps(topic),
            table[:, :3],
            table[:, 3:7],
            table[:, 7:],
            self.frames.get(topic, ""),
            self.child_frames.get(topic, ""),
        )

    def _inertial(self, topic: str | None) -> InertialTrack | None:
        collected = self.sensors.get(topic or "")
        if topic is None or collected is None or not collected.bag:
            return None
        table, frame = collected.table(), self.frames.get(topic, "")
        return InertialTrack(collected.stamps(topic), frame, table[:, :3], table[:, 3:])

    def _empty(self, topics: list[str]) -> str:
        faults = [f" {topic}: {self.faults[topic]}" for topic in topics if topic in self.faults]
        return (
            f"{self.recording.path}: no readable message on {', '.join(topics)}.{''.join(faults)}"
        )

    def _losses(self) -> tuple[Damage, ...]:
        undecoded = [
            Damage(f"does not decode; the first: {self.faults[topic]}", topic, count)
            for topic, count in sorted(self.broken.items())
        ]
        topics = self.robot.topics
        optional = {"command": topics.command, "imu": topics.imu}
        absent = [
            Damage(f"named as {role} in the robot manifest, not in the recording", topic)
            for role, topic in optional.items()
            if topic is not None and topic not in self.recording.topics
        ]
        return (*self.recording.losses, *undecoded, *absent)


def _known_frames(robot: Robot) -> list[str]:
    named = (robot.base_frame, robot.odometry_frame, robot.camera.frame, robot.lidar.frame)
    return [frame for frame in named if frame]


def _is_tf(recording: Recording, topic: str) -> bool:
    return recording.topics[topic].message_type in TF_TYPES


def _require_topics(recording: Recording, topics: Topics) -> None:
    if not recording.topics:
        raise RecordingError(f"{recording.path}: no messages.")
    needed = {"image": topics.image, "points": topics.points, "odometry": topics.odometry}
    if topics.odometry == BY_LIDAR:
        del needed["odometry"]
    missing = [f"{use} {name}" for use, name in needed.items() if name not in recording.topics]
    if missing:
        present = ", ".join(f"{t.name} [{t.message_type}]" for t in recording.topics.values())
        raise RecordingError(
            f"{recording.path}: lacks the topics of the robot manifest: {', '.join(missing)}. "
            f"It holds: {present}. Correct `topics` in the robot manifest, or start from "
            f"`graspe scaffold`."
        )
