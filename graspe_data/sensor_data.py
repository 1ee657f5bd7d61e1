"""Decoded messages as arrays. ``stamp_ns`` is the header stamp, None where the type has none."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from graspe_data.robot import Intrinsics


@dataclass(frozen=True)
class Picture:
    """An image, uint8 (H, W, 3), RGB."""

    stamp_ns: int
    frame: str
    rgb: NDArray[np.uint8]


@dataclass(frozen=True)
class PointCloud:
    """A cloud without invalid returns, in the frame it was published in.

    ``xyz``: float32 (N, 3), metres. ``intensity``: float32 (N,) on the sensor's own scale, or None.
    ``ring``: int32 (N,), or None; an organised cloud gives its row. NaN, infinite and (0, 0, 0)
    returns are removed.
    """

    stamp_ns: int
    frame: str
    xyz: NDArray[np.float32]
    intensity: NDArray[np.float32] | None
    ring: NDArray[np.int32] | None


@dataclass(frozen=True)
class Motion:
    """One odometry-like sample: pose in the odometry frame, velocity in the body frame.

    ``position`` (3,) metres and ``quaternion`` (4,) x, y, z, w are None for a pure twist;
    ``linear_velocity`` m/s along body x and ``yaw_rate`` rad/s are None for a pure pose. ``twist``
    is all of it as published, linear x, y, z in m/s and angular x, y, z in rad/s, in whatever frame
    the publisher gives it; None where a message has none or nobody kept it.
    """

    stamp_ns: int | None
    frame: str
    child_frame: str
    position: tuple[float, float, float] | None
    quaternion: tuple[float, float, float, float] | None
    linear_velocity: float | None
    yaw_rate: float | None
    twist: tuple[float, float, float, float, float, float] | None = None


@dataclass(frozen=True)
class InertialSample:
    """One IMU sample: angular velocity rad/s and linear acceleration m/s^2, each (x, y, z)."""

    stamp_ns: int
    frame: str
    angular_velocity: tuple[float, float, float]
    linear_acceleration: tuple[float, float, float]


@dataclass(frozen=True)
class PlanarScan:
    """A laser scan: ranges float32 (N,) in metres, NaN and inf as published; angles in rad."""

    stamp_ns: int
    frame: str
    angle_minimum: float
    angle_increment: float
    ranges: NDArray[np.float32]


@dataclass(frozen=True)
class CameraCalibration:
    """The calibration of a CameraInfo message."""

    stamp_ns: int
    frame: str
    intrinsics: Intrinsics


@dataclass(frozen=True)
class StampedTransform:
    """One edge of tf: the child's pose in the parent."""

    stamp_ns: int
    parent: str
    child: str
    translation: tuple[float, float, float]
    quaternion: tuple[float, float, float, float]
