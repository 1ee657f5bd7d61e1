"""Looks into the messages of a topic, by what it could serve as."""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import pairwise
from math import hypot, isfinite
from typing import Any, Final, Protocol

import numpy as np
from numpy.typing import NDArray

from graspe_data.errors import RecordingError
from graspe_data.inspection.roles import Role
from graspe_data.inspection.topic_content import (
    CalibrationContent,
    CloudContent,
    Content,
    FramesContent,
    MotionContent,
    PictureContent,
    Range,
    ScanContent,
)
from graspe_data.recordings.decoding import (
    PictureDecoder,
    decode_calibration,
    decode_inertial,
    decode_motion,
    decode_points,
    decode_scan,
    decode_transforms,
)
from graspe_data.recordings.decoding.lidars.cloud_source import CloudSource
from graspe_data.recordings.messages import RawMessage
from graspe_data.recordings.recording import Recording
from graspe_data.robot import Lidar
from graspe_data.sensor_data import PointCloud, StampedTransform

MAXIMUM_EDGES: Final = 512
_GROUND_WITHIN_M: Final = 10.0
_GROUND_BIN_M: Final = 0.05
_GROUND_POINTS: Final = 100


class Observer(Protocol):
    """Looks at the messages of one topic, one after another; its memory does not grow."""

    def observe(self, message: Any, raw: RawMessage) -> None:
        """Take one message, decoded and as it was; RecordingError where it is of no use."""

    def content(self) -> Content | None:
        """What the messages so far hold; None where that is nothing."""


def observer_of(role: Role, topic: str, message_type: str, recording: Recording) -> Observer:
    """The observer of a topic of a recording that serves a role."""
    if role == "image":
        return _Pictures(topic, message_type)
    if role == "points":
        return _Clouds(topic, message_type, recording=recording)
    if role in ("odometry", "command"):
        return _Motions(topic, message_type)
    if role in ("tf", "tf_static"):
        return _Frames()
    return _First(role, topic)


@dataclass
class _Sampled:
    """Says which messages to look into: the first, second, fourth, eighth and so on."""

    topic: str
    message_type: str
    seen: int = 0

    def due(self) -> bool:
        self.seen += 1
        return self.seen & (self.seen - 1) == 0


@dataclass
class _Pictures(_Sampled):
    """A video is taken from its beginning up to its first picture."""

    found: PictureContent | None = None

    def __post_init__(self) -> None:
        self.decoder = PictureDecoder(self.message_type, self.topic)

    def observe(self, message: Any, raw: RawMessage) -> None:  # noqa: ARG002
        due = self.due()
        if self.found is not None if self.decoder.needs_all else not due:
            return
        for outcome in self.decoder.take(message):
            if outcome.picture is None:
                raise RecordingError(outcome.detail or outcome.reason)
            height, width, _ = outcome.picture.rgb.shape
            self.found = self.found or PictureContent(width, height, _encoding(message))

    def content(self) -> PictureContent | None:
        return self.found


@dataclass
class _Clouds(_Sampled):
    recording: Recording | None = None
    source: CloudSource | None = None
    fields: tuple[str, ...] = ()
    counts: list[int] = field(default_factory=list)
    rings: int | None = None
    brightest: float | None = None
    reflective: float | None = None
    ground: float | None = None

    def observe(self, message: Any, raw: RawMessage) -> None:
        if self.recording is None:
            return
        if self.source is None:
            self.source = CloudSource(self.recording, self.topic, Lidar())
        found = self.source.take(raw)
        if found is None or not self.due():
            return
        cloud = found.decode()
        self.fields = tuple(part.name for part in getattr(message, "fields", ()))
        size = cloud.xyz.shape[0]
        self.counts = [min([size, *self.counts]), max([size, *self.counts])]
        if not size:
            return
        if cloud.ring is not None:
            self.rings = max(self.rings or 0, int(cloud.ring.max()) + 1)
        self.brightest = _brighter(self.brightest, cloud)
        if {"intensity", "reflectivity"} <= set(self.fields):
            calibrated = decode_points(message, self.topic, "reflectivity")
            self.reflective = _brighter(self.reflective, calibrated)
        self.ground = _ground(cloud.xyz) if self.ground is None else self.ground

    def content(self) -> CloudContent | None:
        if not self.counts:
            return None
        span = (self.counts[0], self.counts[-1])
        strengths = self.brightest, self.ground, self.reflective
        return CloudContent(span, self.fields, self.rings, *strengths)


@dataclass
class _Motions:
    topic: str
    message_type: str
    child_frame: str = ""
    linear: list[float] = field(default_factory=list)
    yaw: list[float] = field(default_factory=list)
    place: tuple[float, float] | None = None
    distance: float | None = None

    def observe(self, message: Any, raw: RawMessage) -> None:  # noqa: ARG002
        motion = decode_motion(message, self.message_type, self.topic)
        self.child_frame = self.child_frame or motion.child_frame
        self.linear = _widened(self.linear, motion.linear_velocity)
        self.yaw = _widened(self.yaw, motion.yaw_rate)
        if motion.position is not None and all(map(isfinite, motion.position)):
            x, y, _ = motion.position
            before = self.place or (x, y)
            self.distance = (self.distance or 0.0) + hypot(x - before[0], y - before[1])
            self.place = (x, y)

    def content(self) -> MotionContent:
        return MotionContent(self.child_frame, _range(self.linear), _range(self.yaw), self.distance)


@dataclass
class _Frames:
    edges: dict[tuple[str, str], StampedTransform] = field(default_factory=dict)

    def observe(self, message: Any, raw: RawMessage) -> None:  # noqa: ARG002
        for edge in decode_transforms(message):
            if len(self.edges) < MAXIMUM_EDGES:
                self.edges.setdefault((edge.parent, edge.child), edge)

    def content(self) -> FramesContent:
        return FramesContent(tuple(self.edges[key] for key in sorted(self.edges)))


@dataclass
class _First:
    """Calibrations, scans and inertial samples: each is decoded, the first one kept."""

    role: Role
    topic: str
    found: Content | None = None

    def observe(self, message: Any, raw: RawMessage) -> None:  # noqa: ARG002
        if self.role == "camera_info":
            calibration = decode_calibration(message, self.topic)
            self.found = self.found or CalibrationContent(calibration.intrinsics)
        elif self.role == "scan":
            ranges = decode_scan(message, self.topic).ranges
            missing = int(np.count_nonzero(np.isnan(ranges)))
            self.found = self.found or ScanContent(ranges.size, missing)
        else:
            decode_inertial(message, self.topic)

    def content(self) -> Content | None:
        return self.found


def _encoding(message: Any) -> str:
    """The encoding of a raw picture or a packet, the kind of a file, the codec of a video."""
    if hasattr(message, "encoding"):
        return str(message.encoding)
    if bytes(message.data[:3]) == b"\xff\xd8\xff":
        return "jpeg"
    return "png" if bytes(message.data[:4]) == b"\x89PNG" else str(message.format)


def _brighter(before: float | None, cloud: PointCloud) -> float | None:
    if cloud.intensity is None:
        return before
    known = cloud.intensity[np.isfinite(cloud.intensity)]
    return max(before or 0.0, float(known.max(initial=0.0)))


def _widened(bounds: list[float], value: float | None) -> list[float]:
    if value is None or not isfinite(value):
        return bounds
    return [min([value, *bounds]), max([value, *bounds])]


def _range(bounds: list[float]) -> Range | None:
    return (bounds[0], bounds[1]) if bounds else None


def _ground(xyz: NDArray[np.float32]) -> float | None:
    """The fullest bin of height among the points near and below the sensor."""
    below = (np.hypot(xyz[:, 0], xyz[:, 1]) < _GROUND_WITHIN_M) & (xyz[:, 2] < -_GROUND_BIN_M)
    heights = xyz[below & (xyz[:, 2] > -_GROUND_WITHIN_M), 2]
    if heights.size < _GROUND_POINTS:
        return None
    counts, edges = np.histogram(
        heights, np.arange(-_GROUND_WITHIN_M, _GROUND_BIN_M, _GROUND_BIN_M)
    )
    low, high = list(pairwise(edges.tolist()))[int(counts.argmax())]
    return float(low + high) / 2
