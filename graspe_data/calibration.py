"""Where a robot's sensors sit and how its camera sees: by its manifest, or as recordings tell."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from graspe_data.errors import PlannerError
from graspe_data.geometry import Transform
from graspe_data.manifest import Settings
from graspe_data.robot import Intrinsics, Mounting, Robot, Vector3

Sensor = Literal["camera", "lidar"]
StoredTransform = tuple[
    Annotated[tuple[float, ...], Field(min_length=9, max_length=9)],
    Vector3,
]
"""A rotation, row by row, and a translation in metres, as JSON keeps them."""


@dataclass(frozen=True)
class Calibration:
    """A robot's sensors, resolved.

    ``intrinsics``: of the pictures as the camera gives them. ``base_from_camera`` carries points of
    the optical frame, ``base_from_lidar`` those of the lidar, into base_link. ``camera_frame`` and
    ``lidar_frame`` are the frames that pictures and clouds name; None takes those of the first
    ones that may be a sensor's, see ``planners.sensor_frame``.
    """

    intrinsics: Intrinsics
    base_from_camera: Transform
    base_from_lidar: Transform
    camera_frame: str | None = None
    lidar_frame: str | None = None


class RecordedCalibration(Settings):
    """What a recording tells of its sensors, and ``dataset.json`` keeps; None where it does not.

    Attributes:
        camera: Of the stored picture, without distortion.
        base_from_camera: Carries points of the optical frame into base_link; the last one where
            the camera was mounted anew.
        base_from_lidar: Carries points of the lidar into base_link.
    """

    camera: Intrinsics | None = None
    base_from_camera: StoredTransform | None = None
    base_from_lidar: StoredTransform | None = None

    def mounting(self, sensor: Sensor) -> Transform | None:
        """Where a sensor sat: carries its points into base_link."""
        kept = self.base_from_camera if sensor == "camera" else self.base_from_lidar
        return None if kept is None else restored(kept)


def declared_mounting(robot: Robot, sensor: Sensor) -> Transform | None:
    """A sensor's mounting in the numbers of the manifest; it counts before what is published.

    Returns:
        The transform that carries the sensor's points into base_link; None where the manifest
        leaves it to the recording.
    """
    mounting = (robot.camera if sensor == "camera" else robot.lidar).mounting
    return mounting.transform if isinstance(mounting, Mounting) else None


def calibration_of(robot: Robot) -> Calibration:
    """The calibration that a robot manifest gives in numbers.

    Raises:
        PlannerError: The manifest leaves some of it to the recording.
    """
    intrinsics = robot.camera.intrinsics
    if not isinstance(intrinsics, Intrinsics):
        raise PlannerError(_left_open(robot, "camera.intrinsics", intrinsics))
    camera, lidar = declared_mounting(robot, "camera"), declared_mounting(robot, "lidar")
    if camera is None:
        raise PlannerError(_left_open(robot, "camera.mounting", "tf"))
    if lidar is None:
        raise PlannerError(_left_open(robot, "lidar.mounting", "tf"))
    return Calibration(intrinsics, camera, lidar, robot.camera.frame, robot.lidar.frame)


def stored(transform: Transform) -> StoredTransform:
    """A transform as JSON keeps it."""
    x, y, z = transform.translation.tolist()
    return tuple(transform.rotation.ravel().tolist()), (x, y, z)


def restored(kept: StoredTransform) -> Transform:
    """The transform of ``stored``."""
    rotation, translation = kept
    return Transform(np.reshape(np.array(rotation, np.float64), (3, 3)), np.array(translation))


def _left_open(robot: Robot, key: str, found: str) -> str:
    return (
        f"robot {robot.name}: {key} is left to {found!r}, which a planner does not read. Give it "
        "in numbers in the robot manifest, or make the Calibration from what the robot publishes."
    )
