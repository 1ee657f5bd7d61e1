"""What the messages of a topic hold: sizes, fields, ranges, frames."""

from __future__ import annotations

from dataclasses import dataclass

from graspe_data.robot import Intrinsics
from graspe_data.sensor_data import StampedTransform

Range = tuple[float, float]


@dataclass(frozen=True)
class PictureContent:
    """Pictures: pixels, and the encoding: of the message, or ``jpeg`` or ``png``."""

    width: int
    height: int
    encoding: str


@dataclass(frozen=True)
class CloudContent:
    """Clouds, by a sample of them.

    ``points`` are the fewest and most valid returns; ``ground_z`` is the height, in the cloud's
    frame, at which most points near and below the sensor lie, None where there are few.
    """

    points: tuple[int, int]
    fields: tuple[str, ...]
    rings: int | None
    intensity_maximum: float | None
    ground_z: float | None
    reflectivity_maximum: float | None = None
    """Of the field ``reflectivity``, where there is one beside another intensity."""


@dataclass(frozen=True)
class MotionContent:
    """Motion: frame, ranges of velocity in m/s and rad/s, distance along the poses in m."""

    child_frame: str
    linear_velocity: Range | None
    yaw_rate: Range | None
    distance_m: float | None


@dataclass(frozen=True)
class ScanContent:
    """Planar scans: rays of the first one, and how many of them are NaN."""

    rays: int
    not_a_number: int


@dataclass(frozen=True)
class CalibrationContent:
    """The first calibration, by K and D."""

    intrinsics: Intrinsics


@dataclass(frozen=True)
class FramesContent:
    """The edges of a tf topic, each as first published; beyond 512 they are left out."""

    edges: tuple[StampedTransform, ...]


Content = (
    PictureContent | CloudContent | MotionContent | ScanContent | CalibrationContent | FramesContent
)
