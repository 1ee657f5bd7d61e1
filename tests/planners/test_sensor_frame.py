"""Sensors' messages are taken in the sensor's frame, and in no other."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from graspe_data.errors import PlannerError
from graspe_data.geometry import Transform
from planners.lidar_clouds import LidarClouds
from planners.sensor_frame import SensorFrame
from tests.planners.every_planner import sound, with_cloud

MOTIONS = sound().motions
MOVED = tuple(replace(motion, frame="/run_7", child_frame="hull") for motion in MOTIONS)


@pytest.mark.parametrize(
    "frame", ["velodyne", "os_sensor", "livox_frame", "robot1/rslidar", "/vlp"]
)
def test_a_lidars_frame_is_taken_where_none_is_declared(frame: str) -> None:
    lidar = SensorFrame("lidar")
    lidar.check(frame, MOTIONS)
    lidar.check(frame.lstrip("/"), MOTIONS)
    with pytest.raises(PlannerError, match=f"expected {frame.lstrip('/')!r}"):
        lidar.check("another", MOTIONS)


NO_LIDARS = (
    ("odom", "/odom", "map", "Map", "world", "camera_init", "spot/odom", "robot1_base_link"),
    ("base_link", "base_footprint", "body", "camera_color_optical_frame", "camera_link", ""),
)


@pytest.mark.parametrize("frame", [*NO_LIDARS[0], *NO_LIDARS[1]])
def test_frames_that_are_no_lidars(frame: str) -> None:
    with pytest.raises(PlannerError, match=r"lidar\.frame"):
        SensorFrame("lidar").check(frame, MOTIONS)


@pytest.mark.parametrize("frame", ["run_7", "hull", "/hull"])
@pytest.mark.parametrize("sensor", ["lidar", "camera"])
def test_the_frames_of_the_odometry_are_no_sensors_whatever_they_are_called(
    frame: str, sensor: str
) -> None:
    with pytest.raises(PlannerError, match="which is no"):
        SensorFrame("lidar" if sensor == "lidar" else "camera").check(frame, MOVED)


def test_what_is_declared_is_taken_whatever_it_is_called() -> None:
    declared = SensorFrame("lidar", "/body")
    declared.check("body", MOTIONS)
    for other in ("velodyne", "odom"):
        with pytest.raises(PlannerError, match="expected 'body'"):
            declared.check(other, MOTIONS)


def test_a_cameras_frame_may_be_optical() -> None:
    SensorFrame("camera").check("camera_color_optical_frame", MOTIONS)


@pytest.mark.parametrize(("lasers", "declared", "refuses"), [(32, 16, True), (16, 16, False)])
@pytest.mark.parametrize("named", [True, False])
def test_more_rings_than_declared_are_told(
    lasers: int, declared: int, refuses: bool, named: bool
) -> None:
    azimuth = np.linspace(-np.pi, np.pi, 360, endpoint=False)
    slope = np.linspace(-0.4, 0.2, lasers)
    reach = 4 + np.sin(3 * azimuth)[None] + 2 * slope[:, None]
    x, y, z = (reach * np.cos(azimuth), reach * np.sin(azimuth), reach * slope[:, None])
    xyz = np.stack((x, y, z), axis=-1).reshape(-1, 3).astype(np.float32)
    ring = np.repeat(np.arange(lasers), 360).astype(np.int32) if named else None
    moment, clouds = (
        with_cloud(sound(), xyz=xyz, ring=ring, intensity=None),
        LidarClouds(None, declared),
    )
    if refuses:
        for _ in range(2):
            with pytest.raises(PlannerError, match=r"`lidar\.rings` of the robot manifest is 16"):
                clouds.cloud(moment, Transform.identity(), 0.0)
    else:
        assert clouds.cloud(moment, Transform.identity(), 0.0) is moment.cloud
