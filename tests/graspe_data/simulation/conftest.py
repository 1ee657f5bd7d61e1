"""Small worlds and a robot for the tests of motion and truth."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import pytest

from graspe_data.manifest import find_manifest, load_manifest
from graspe_data.robot import Robot
from graspe_data.simulation.motion.drive import Drive
from graspe_data.simulation.motion.drive_robot import drive_robot
from graspe_data.simulation.motion.drivers import Leg, ScriptedDriver
from graspe_data.simulation.motion.gait import GaitSettings
from graspe_data.simulation.motion.mechanics import SlipSettings
from graspe_data.simulation.motion.motion_settings import MotionSettings
from graspe_data.simulation.motion.wheel_odometry import OdometrySettings
from graspe_data.simulation.world.mesh import join_meshes
from graspe_data.simulation.world.obstacles import Obstacle, Obstacles
from graspe_data.simulation.world.world import Ground, World

WorldOf = Callable[..., World]
DriveOf = Callable[..., Drive]


@pytest.fixture(scope="session")
def spot() -> Robot:
    return load_manifest(find_manifest("robots", "spot"), Robot)


@pytest.fixture(scope="session")
def world_of() -> WorldOf:
    def build(
        *obstacles: Obstacle,
        ground: Ground | None = None,
        start: tuple[float, float, float] = (0.0, 0.0, 0.0),
    ) -> World:
        flat = ground or Ground(np.zeros((2, 2)), (-50.0, -50.0), 100.0)
        arena = (-20.0, -15.0, 20.0, 15.0)
        return World(join_meshes([]), (), Obstacles.of(obstacles), flat, arena, start)

    return build


@pytest.fixture(scope="session")
def exact() -> MotionSettings:
    """No slip, no gait, and an odometry without errors."""
    return MotionSettings(
        slip=SlipSettings(mean=0.0, spread=0.0),
        gait=GaitSettings(bob=0.0, sway=0.0, footfall=0.0),
        odometry=OdometrySettings(scale=0.0, speed_noise=0.0, yaw_rate_noise=0.0, yaw_walk=0.0),
    )


@pytest.fixture(scope="session")
def scripted(spot: Robot, exact: MotionSettings) -> DriveOf:
    def drive(
        world: World, legs: Sequence[Leg], settings: MotionSettings | None = None, seed: int = 0
    ) -> Drive:
        seconds = sum(leg.duration_s for leg in legs)
        generator = np.random.default_rng(seed)
        driver = ScriptedDriver(legs)
        return drive_robot(world, spot, driver, settings or exact, seconds, generator)

    return drive
