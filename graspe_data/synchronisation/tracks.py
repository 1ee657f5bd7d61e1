"""What the first pass over a recording finds, topic by topic, as arrays."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from graspe_data.geometry import FrameTree
from graspe_data.recordings.messages import Loss
from graspe_data.sensor_data import CameraCalibration

Stamps = NDArray[np.int64]


@dataclass(frozen=True)
class StampTrack:
    """The stamps of a topic's messages in the order the reader yields them, int64 ns.

    ``header_ns`` is None where the message type has no header. ``ordinal`` counts the topic's
    messages in that order; those too damaged to hold a stamp are left out.
    """

    topic: str
    header_ns: Stamps | None
    bag_ns: Stamps
    ordinal: Stamps


@dataclass(frozen=True)
class MotionTrack:
    """Odometry, commands or poses as arrays of one row a message, in the reader's order.

    ``position`` (N, 3) metres and ``quaternion`` (N, 4) are NaN where the type has no pose,
    ``velocity`` (N, 2) holds (m/s, rad/s) in the body frame, NaN where the type has no twist.
    """

    stamps: StampTrack
    position: NDArray[np.float64]
    quaternion: NDArray[np.float64]
    velocity: NDArray[np.float64]


@dataclass(frozen=True)
class InertialTrack:
    """IMU samples in their own frame: ``gyro`` (N, 3) rad/s, ``acceleration`` (N, 3) m/s^2."""

    stamps: StampTrack
    frame: str
    gyro: NDArray[np.float64]
    acceleration: NDArray[np.float64]


@dataclass(frozen=True)
class Tracks:
    """All that synchronisation needs to know of a recording before a picture is decoded."""

    image: StampTrack
    points: StampTrack
    odometry: MotionTrack
    command: MotionTrack | None
    imu: InertialTrack | None
    calibration: CameraCalibration | None
    frames: FrameTree
    losses: tuple[Loss, ...]
