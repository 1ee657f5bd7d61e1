"""Drive a robot through a world."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from graspe_data.geometry import Floats
from graspe_data.manifest import Settings
from graspe_data.robot import Robot
from graspe_data.simulation.motion.body_attitude import follow_ground
from graspe_data.simulation.motion.drive import STEP_S, Contacts, Drive
from graspe_data.simulation.motion.drivers import COMMAND_STEPS, Driver, RobotState
from graspe_data.simulation.motion.gait import GaitSettings, walk
from graspe_data.simulation.motion.inertial import body_rates, felt_acceleration
from graspe_data.simulation.motion.mechanics import MechanicsSettings
from graspe_data.simulation.motion.slip import SlipSettings, slip_shares
from graspe_data.simulation.motion.stumbling import Stumble, Stumbling
from graspe_data.simulation.motion.walker import Step, Walker
from graspe_data.simulation.motion.wheel_odometry import OdometrySettings, dead_reckoning
from graspe_data.simulation.world.world import World


class MotionSettings(Settings):
    """How a robot moves, and what its own sensors make of it."""

    mechanics: MechanicsSettings = MechanicsSettings()
    slip: SlipSettings = SlipSettings()
    gait: GaitSettings = GaitSettings()
    odometry: OdometrySettings = OdometrySettings()


@dataclass(frozen=True)
class _Track:
    """The steps as they were taken: poses and commands, arrays of N rows."""

    poses: Floats
    commands: Floats
    steps: list[Step]
    stumbles: list[Stumble]


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
    time_s = np.arange(max(2, round(duration_s / STEP_S)), dtype=np.float64) * STEP_S
    slips, stumbles, errors = generator.spawn(3)
    slip = slip_shares(settings.slip, time_s, slips)
    stumbling = Stumbling(settings.mechanics, stumbles)
    walker = Walker(world.obstacles, robot, settings.mechanics, stumbling, world.start)
    track = _walk(walker, driver, time_s, slip, stumbling)
    return _felt(world, robot, settings, time_s, slip, track, errors)


def _walk(
    walker: Walker, driver: Driver, time_s: Floats, slip: Floats, stumbling: Stumbling
) -> _Track:
    poses, commands = np.empty((len(time_s), 3)), np.empty((len(time_s), 2))
    steps = [Step((0.0, 0.0))]
    shares = slip.tolist()
    for index in range(len(time_s)):
        if index % COMMAND_STEPS == 0:
            command = driver.command(_state(index * STEP_S, walker, steps[-1]))
        if index:
            steps.append(walker.step(index, command, shares[index]))
        poses[index], commands[index] = walker.pose, command
    return _Track(poses, commands, steps, stumbling.stumbles)


def _state(time_s: float, walker: Walker, last: Step) -> RobotState:
    x, y, yaw = walker.pose.tolist()
    return RobotState(
        time_s, (x, y, yaw), last.velocity, last.stopped, last.speed_share, last.entangled
    )


def _felt(
    world: World,
    robot: Robot,
    settings: MotionSettings,
    time_s: Floats,
    slip: Floats,
    track: _Track,
    errors: np.random.Generator,
) -> Drive:
    """What the body does on the ground, and what its sensors report."""
    ground, slope = follow_ground(world.ground, robot.footprint, track.poses)
    gait = walk(settings.gait, track.commands, time_s)
    tilts = _tilts(track.stumbles, settings.mechanics.stumble_s, time_s)
    height = ground + robot.base_height + gait.height
    attitude = np.column_stack([slope + gait.tilt + tilts, track.poses[:, 2]])
    velocity = np.array([step.velocity for step in track.steps])
    contacts = _contacts(track, settings.mechanics.stumble_s)
    measured, odometry = dead_reckoning(settings.odometry, velocity, slip, errors)
    felt = felt_acceleration(velocity, contacts.impact, height, attitude) + gait.bumps
    return Drive(
        time_s,
        np.column_stack([track.poses[:, :2], height]),
        attitude,
        velocity,
        track.commands,
        measured,
        odometry,
        felt,
        body_rates(attitude),
        contacts,
    )


def _tilts(stumbles: list[Stumble], stumble_s: float, time_s: Floats) -> Floats:
    """Roll and pitch (N, 2) in rad: the body tips over and back, as sin^2."""
    tilts = np.zeros((len(time_s), 2))
    for stumble in stumbles:
        phase = np.clip((time_s - stumble.step * STEP_S) / stumble_s, 0.0, 1.0)
        tip = stumble.tilt * np.sin(np.pi * phase) ** 2
        tilts += tip[:, None] * (np.sin(stumble.direction), np.cos(stumble.direction))
    return tilts


def _contacts(track: _Track, stumble_s: float) -> Contacts:
    stumbling: NDArray[np.bool_] = np.zeros(len(track.steps), np.bool_)
    for stumble in track.stumbles:
        stumbling[stumble.step : stumble.step + round(stumble_s / STEP_S)] = True
    return Contacts(
        np.array([step.stopped for step in track.steps]),
        np.array([step.impact for step in track.steps]),
        np.array([step.speed_share for step in track.steps]),
        np.array([step.entangled for step in track.steps]),
        stumbling,
    )
