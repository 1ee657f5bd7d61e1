"""Drive a robot through a world."""

from __future__ import annotations

import numpy as np

from graspe_data.robot import Robot
from graspe_data.simulation.motion.drive import Drive
from graspe_data.simulation.motion.drive_in_progress import DriveInProgress
from graspe_data.simulation.motion.drivers import Driver
from graspe_data.simulation.motion.motion_settings import MotionSettings
from graspe_data.simulation.world.world import World


def drive_robot(
    world: World,
    robot: Robot,
    driver: Driver,
    settings: MotionSettings,
    duration_s: float,
    generator: np.random.Generator,
) -> Drive:
    """Drive from the world's start, where the robot stands.

    Args:
        world: Obstacles and ground.
        robot: Limits of acceleration, footprint, height of base_link.
        driver: Asked for a command every 0.1 s. Its commands are not clipped to the robot's
            limits of velocity, since a recovery may go backwards.
        settings: Contact, slip, gait, odometry.
        duration_s: Of the drive; at least two steps are taken.
        generator: Draws slip, stumbles and the errors of the odometry.
    """
    drive = DriveInProgress(world, robot, settings, duration_s, generator)
    while not drive.over:
        drive.advance(driver.command(drive.state))
    return drive.drive()
