"""Where a robot's sensors sit and how its camera sees."""

from __future__ import annotations

from dataclasses import dataclass

from graspe_data.errors import PlannerError
from graspe_data.geometry import Transform
from graspe_data.robot import Intrinsics, Mounting, Robot


@dataclass(frozen=True)
class Calibration:
    """A robot's sensors, resolved.

    ``intrinsics``: of the pictures as the camera gives them. ``base_from_camera`` carries points of
    the optical frame, ``base_from_lidar`` those of the lidar, into base_link. ``camera_frame`` and
    ``lidar_frame`` are the frames that pictures and clouds name; None takes those of the first
    ones that may be a sensor's, see ``SensorFrame``.
    """

    intrinsics: Intrinsics
    base_from_camera: Transform
    base_from_lidar: Transform
    camera_frame: str | None = None
    lidar_frame: str | None = None


def calibration_of(robot: Robot) -> Calibration:
    """The calibration that a robot manifest gives in numbers.

    Raises:
        PlannerError: The manifest leaves some of it to the recording.
    """
    camera, lidar = robot.camera, robot.lidar
    if not isinstance(camera.intrinsics, Intrinsics):
        raise PlannerError(_left_open(robot, "camera.intrinsics", camera.intrinsics))
    if not isinstance(camera.mounting, Mounting):
        raise PlannerError(_left_open(robot, "camera.mounting", camera.mounting))
    if not isinstance(lidar.mounting, Mounting):
        raise PlannerError(_left_open(robot, "lidar.mounting", lidar.mounting))
    mountings = camera.mounting.transform, lidar.mounting.transform
    return Calibration(camera.intrinsics, *mountings, camera.frame, lidar.frame)


def _left_open(robot: Robot, key: str, found: str) -> str:
    return (
        f"robot {robot.name}: {key} is left to {found!r}, which a planner does not read. Give it "
        "in numbers in the robot manifest, or make the Calibration from what the robot publishes."
    )
