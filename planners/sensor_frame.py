"""Whether what a sensor gives is in that sensor's own frame."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Literal

from graspe_data.errors import PlannerError
from graspe_data.geometry import plain_frame
from graspe_data.sensor_data import Motion

Sensor = Literal["camera", "lidar"]

_PLACES = frozenset(
    {"base", "baselink", "body", "chassis", "combined", "earth", "enu", "flat", "footprint", "frd"}
    | {"global", "gpe", "ground", "imu", "init", "local", "map", "ned", "odom", "odometry", "robot"}
    | {"stabilized", "utm", "vision", "world"}
)
_SENSORS = frozenset(
    {"cam", "hesai", "laser", "lidar", "livox", "os_", "ouster", "point", "rslidar", "scan"}
    | {"sensor", "velodyne", "vlp"}
)
"""Parts of the usual names of frames that are neither a camera's nor a lidar's (REP 105; mavros';
Spot's; LOAM's), and of those that are."""


def _is_place(frame: str) -> bool:
    """Whether a name is that of a frame of the robot or of the ground, and not of a sensor."""
    name = frame.rpartition("/")[2].lower()
    if name == "camera_init":
        return True
    if any(sensor in name for sensor in _SENSORS):
        return False
    parts = {part.rstrip("0123456789") for part in re.split(r"[^a-z0-9]+", name)}
    return bool(parts & _PLACES)


_CAMERAS = ("optical", "camera", "image")


class SensorFrame:
    """The one frame in which a sensor's messages are taken.

    That is the calibration's. Where the calibration leaves it open it is that of the first message
    whose frame may be the sensor's: not the robot's base nor its odometry's, and for a lidar no
    camera's. A message in any other frame is refused, and not carried: where it lies on the robot
    is not known here.
    """

    def __init__(self, sensor: Sensor, frame: str | None = None) -> None:
        """Take the calibration's frame; None where it tells none."""
        self._sensor = sensor
        self._declared = plain_frame(frame or "") or None
        self._frame = self._declared

    def check(self, frame: str, motions: Sequence[Motion]) -> None:
        """Refuse a message's frame that is not the sensor's.

        Args:
            frame: Of the message.
            motions: Of the same situation; their frames are the odometry's and the base's.

        Raises:
            PlannerError: Names the frame and the expected one.
        """
        found = plain_frame(frame) if isinstance(frame, str) else ""
        fault = self._fault(found, motions)
        if fault:
            what = "cloud" if self._sensor == "lidar" else "picture"
            raise PlannerError(
                f"the {what} is in the frame {found!r}, {fault}: give it in the {self._sensor}'s "
                f"own frame, and name that as `{self._sensor}.frame` in the robot manifest."
            )
        self._frame = found

    def _fault(self, frame: str, motions: Sequence[Motion]) -> str:
        if self._frame is not None:
            return "" if frame == self._frame else f"expected {self._frame!r}"
        if not frame:
            return "which names none"
        last = motions[-1] if motions else None
        moving = (plain_frame(last.frame), plain_frame(last.child_frame)) if last else ()
        if frame in moving or _is_place(frame):
            return f"which is no {self._sensor}'s"
        if self._sensor == "lidar" and any(name in frame.lower() for name in _CAMERAS):
            return "which is a camera's"
        return ""
