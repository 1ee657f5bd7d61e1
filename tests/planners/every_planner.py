"""Every planner as a robot would run it, and a situation in which each of them drives."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from graspe_data.sensor_data import Picture, PointCloud
from planners.dwa_fox import DwaFox
from planners.dwa_lab import DwaLab
from planners.dwa_map import DwaMap
from planners.fitness import GuardSettings
from planners.glass_slam_source import GlassSlamSource
from planners.graspe_planner import GraspePlanner
from planners.guarded import Guarded
from planners.intensity_source import IntensitySource
from planners.lidar_clouds import LidarClouds
from planners.obstacles import ScanObstacles
from planners.occupancy_source import OccupancySource
from planners.scorer import Scorer
from planners.situation import Command, Planner, Situation
from tests.planners.conftest import NOW, Robots, motions_until

SECOND = 10**9
DRIVEN = (0.3, 0.0)


def _scan(robots: Robots) -> ScanObstacles:
    robot = robots.robot
    return ScanObstacles(
        robots.lidar,
        robot.base_height,
        robot.lidar.minimum_range,
        clouds=LidarClouds.of(robot),
    )


PLANNERS: Mapping[str, Callable[[Robots], Planner]] = {
    "dwa_fox": lambda robots: DwaFox(robots.robot, _scan(robots)),
    "dwa_lab": lambda robots: DwaLab(robots.robot, _scan(robots)),
    "dwa_map": lambda robots: DwaMap(robots.robot, OccupancySource(robots.robot, robots.lidar)),
    "mim": lambda robots: DwaMap(robots.robot, IntensitySource(robots.robot, robots.lidar)),
    "glass_slam": lambda robots: DwaMap(robots.robot, GlassSlamSource(robots.robot, robots.lidar)),
    "graspe": lambda robots: GraspePlanner(robots.robot, Scorer(robots.bundle, robots.calibration)),
}
BY_INTENSITY, BY_MODEL = ("mim", "glass_slam"), ("graspe",)


def guarded(name: str, robots: Robots, **settings: Any) -> Guarded:
    """A planner by its name; it has the time that a busy machine takes."""
    given = {"answer_s": 30.0} | settings
    guard = GuardSettings(needs_picture=name in BY_MODEL, **given)
    return Guarded(PLANNERS[name](robots), robots.robot.limits, guard)


def sound(now_ns: int = NOW) -> Situation:
    """A robot that drives straight on, on open ground, with something solid far to its left."""
    return Situation(
        now_ns=now_ns,
        pose=(0.0, 0.0, 0.0),
        velocity=DRIVEN,
        goal=(8.0, 0.0),
        picture=Picture(now_ns - 50_000_000, "camera_optical", np.full((48, 64, 3), 200, np.uint8)),
        cloud=cloud(now_ns - 80_000_000),
        motions=motions_until(now_ns, DRIVEN),
    )


def cloud(stamp_ns: int) -> PointCloud:
    """Dim ground on two rings, and a bright wall on a third, 6 m to the left."""
    angle = np.linspace(-1.5, 1.5, 150)
    rings = [np.stack((r * np.cos(angle), r * np.sin(angle), 0 * angle - 0.8), 1) for r in (3, 5)]
    along = np.linspace(-3.0, 3.0, 150)
    wall = np.stack((along, 0 * along + 6, 0 * along), axis=1)
    strength = np.concatenate([20 + np.arange(300) % 40, 180 + np.arange(150) % 60])
    ring = np.repeat(np.arange(3), 150).astype(np.int32)
    xyz = np.concatenate([*rings, wall]).astype(np.float32)
    return PointCloud(stamp_ns, "velodyne", xyz, strength.astype(np.float32), ring)


def seen_anew(moment: Situation, number: int) -> Situation:
    """The same cloud as another turn of a lidar gives it: the last digits differ."""
    assert moment.cloud is not None
    xyz = moment.cloud.xyz + np.float32(1e-5 * (number % 100))
    return with_cloud(moment, xyz=xyz)


def with_cloud(moment: Situation, **changes: Any) -> Situation:
    """The situation with some of its cloud changed."""
    assert moment.cloud is not None
    return replace(moment, cloud=replace(moment.cloud, **changes))


def with_picture(moment: Situation, **changes: Any) -> Situation:
    """The situation with some of its picture changed."""
    assert moment.picture is not None
    return replace(moment, picture=replace(moment.picture, **changes))


def stops(command: Command) -> bool:
    """Whether a command brakes as hard as the robot can, from the velocity driven."""
    return command.linear_velocity <= DRIVEN[0] - 0.1 + 1e-9 and command.yaw_rate == 0.0
