"""What the first pass over a recording finds, topic by topic, as arrays."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

from graspe_data.arrays import Floats, Mask, Stamps
from graspe_data.recordings.identity import ContentIdentity
from graspe_data.recordings.messages import Damage
from graspe_data.sensor_data import CameraCalibration


@dataclass(frozen=True)
class StampTrack:
    """The stamps of a topic's messages in the order the reader yields them, int64 ns.

    ``header_ns`` is None where the message type has no header. ``ordinal`` counts the topic's
    messages in that order; those too damaged to hold a stamp are left out. ``written`` rises in the
    order in which the messages were written to the files.
    """

    topic: str
    header_ns: Stamps | None
    bag_ns: Stamps
    ordinal: Stamps
    written: Stamps | None = None

    @property
    def order(self) -> Stamps:
        """The order of writing, or that of the reader where nothing else is known."""
        return self.ordinal if self.written is None else self.written

    def only(self, kept: Mask) -> StampTrack:
        """The messages of a mask (N,)."""
        return StampTrack(
            self.topic,
            None if self.header_ns is None else self.header_ns[kept],
            self.bag_ns[kept],
            self.ordinal[kept],
            None if self.written is None else self.written[kept],
        )


@dataclass(frozen=True)
class MotionTrack:
    """Odometry, commands or poses as arrays of one row a message, in the reader's order.

    ``position`` (N, 3) metres and ``quaternion`` (N, 4) give the child frame in ``frame``, NaN
    where the type has no pose. ``twist`` (N, 6) is linear m/s and angular rad/s as published, NaN
    where the type has no twist: in the child's frame by the convention of ROS, in ``frame`` by that
    of some drivers.
    """

    stamps: StampTrack
    position: Floats
    quaternion: Floats
    twist: Floats
    frame: str = ""
    child_frame: str = ""

    def only(self, kept: Mask) -> MotionTrack:
        """The messages of a mask (N,)."""
        return replace(
            self,
            stamps=self.stamps.only(kept),
            position=self.position[kept],
            quaternion=self.quaternion[kept],
            twist=self.twist[kept],
        )


@dataclass(frozen=True)
class InertialTrack:
    """IMU samples in their own frame: ``gyro`` (N, 3) rad/s, ``acceleration`` (N, 3) m/s^2."""

    stamps: StampTrack
    frame: str
    gyro: Floats
    acceleration: Floats

    def only(self, kept: Mask) -> InertialTrack:
        """The messages of a mask (N,)."""
        return InertialTrack(
            self.stamps.only(kept), self.frame, self.gyro[kept], self.acceleration[kept]
        )


@dataclass(frozen=True)
class EdgeTrack:
    """One edge of tf as published on one topic: the child's poses in the parent.

    ``translation`` (N, 3) metres, ``quaternion`` (N, 4). ``latched`` tells a topic of static
    transforms, whose messages count from when they come, whatever their stamps. Of equal
    transforms in a row some ten a second are kept.
    """

    stamps: StampTrack
    parent: str
    child: str
    translation: Floats
    quaternion: Floats
    latched: bool

    @property
    def name(self) -> str:
        """The edge as people write it."""
        return f"{self.parent} -> {self.child}"

    def only(self, kept: Mask) -> EdgeTrack:
        """The samples of a mask (N,)."""
        return replace(
            self,
            stamps=self.stamps.only(kept),
            translation=self.translation[kept],
            quaternion=self.quaternion[kept],
        )


@dataclass(frozen=True)
class Tracks:
    """All that synchronisation needs to know of a recording before a picture is decoded.

    ``odometry`` is None where it is to be made of ``edges``. ``image_frame`` and ``points_frame``
    are those of the first message of each.
    """

    image: StampTrack
    points: StampTrack
    odometry: MotionTrack | None
    command: MotionTrack | None
    imu: InertialTrack | None
    calibration: CameraCalibration | None
    edges: tuple[EdgeTrack, ...]
    image_frame: str
    points_frame: str
    losses: tuple[Damage, ...]
    camera_info_frame: str = ""
    picture_size: tuple[int, int] | None = None
    """Width and height of the first picture; None of a video, or where it does not decode."""
    unusable_edges: tuple[str, ...] = ()
    """What was skipped of tf: the edge, how often, and why."""
    lidar_notes: tuple[str, ...] = ()
    """What a user should know of how packets are read."""
    content: ContentIdentity = field(default_factory=ContentIdentity)
