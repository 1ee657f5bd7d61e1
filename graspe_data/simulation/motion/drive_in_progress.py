"""A drive while it is driven: commands go in, and what the robot feels comes out."""

from __future__ import annotations

import numpy as np

from graspe_data.arrays import Floats
from graspe_data.robot import Robot
from graspe_data.simulation.motion.drive import STEP_S, Contacts, Drive
from graspe_data.simulation.motion.drivers import COMMAND_STEPS, RobotState
from graspe_data.simulation.motion.gait import walk
from graspe_data.simulation.motion.inertial import body_rates, felt_acceleration, follow_ground
from graspe_data.simulation.motion.mechanics import slip_shares
from graspe_data.simulation.motion.motion_settings import MotionSettings
from graspe_data.simulation.motion.stumbling import Stumbling, stumble_tilts, stumbling_at
from graspe_data.simulation.motion.walker import Step, Velocity, Walker
from graspe_data.simulation.motion.wheel_odometry import dead_reckoning, draw_odometry_errors
from graspe_data.simulation.world.world import World


class DriveInProgress:
    """A robot on its way from the world's start, where it stands.

    Everything that is drawn is drawn for the longest drive there may be: one that is ended sooner
    is the beginning of the longer one.
    """

    def __init__(
        self,
        world: World,
        robot: Robot,
        settings: MotionSettings,
        longest_s: float,
        generator: np.random.Generator,
    ) -> None:
        """Stand at the start.

        Args:
            world: Obstacles and ground.
            robot: Limits of acceleration, footprint, height of base_link.
            settings: Contact, slip, gait, odometry.
            longest_s: Seconds after which the drive is over; at least two steps are taken.
            generator: Draws slip, stumbles and the errors of the odometry.
        """
        count = max(2, round(longest_s / STEP_S))
        self._world, self._robot, self._settings = world, robot, settings
        self._time_s = np.arange(count, dtype=np.float64) * STEP_S
        slips, stumbles, errors = generator.spawn(3)
        self._slip = slip_shares(settings.slip, self._time_s, slips)
        self._stumbling = Stumbling(settings.mechanics, stumbles)
        self._walker = Walker(
            world.obstacles, robot, settings.mechanics, self._stumbling, world.start
        )
        self._errors = draw_odometry_errors(settings.odometry, count, errors)
        self._poses, self._commands = np.empty((count, 3)), np.empty((count, 2))
        self._velocity = np.empty((count, 2))
        self._steps: list[Step] = []

    @property
    def steps(self) -> int:
        """Steps taken; the next one is of the time ``steps`` times ``STEP_S``."""
        return len(self._steps)

    @property
    def over(self) -> bool:
        """Whether the longest time is used up."""
        return self.steps >= len(self._time_s)

    @property
    def state(self) -> RobotState:
        """The robot now."""
        x, y, yaw = self._walker.pose.tolist()
        last = self._steps[-1] if self._steps else Step((0.0, 0.0))
        return RobotState(
            self.steps * STEP_S,
            (x, y, yaw),
            last.velocity,
            last.stopped,
            last.speed_share,
            last.entangled,
        )

    def advance(self, command: Velocity, steps: int = COMMAND_STEPS) -> None:
        """Hold a command, m/s and rad/s, for some steps, or until the drive is over."""
        for index in range(self.steps, min(self.steps + steps, len(self._time_s))):
            standing = Step((0.0, 0.0))
            step = (
                self._walker.step(index, command, float(self._slip[index])) if index else standing
            )
            self._steps.append(step)
            self._poses[index], self._commands[index] = self._walker.pose, command
            self._velocity[index] = step.velocity

    def odometry(self) -> tuple[Floats, Floats]:
        """What the odometry has reported so far: v, omega (N, 2) and x, y, yaw (N, 3)."""
        count = self.steps
        seen = self._settings.odometry.slip_seen
        return dead_reckoning(self._errors, self._velocity[:count], self._slip[:count], seen)

    def drive(self, since: int = 0) -> Drive:
        """The drive so far, from a step on; two steps at least have to be taken from there.

        The body's tilt and height are smoothed over ``body_attitude.SUSPENSION_S`` and the gait
        over half a second, to both sides; near the ends they are those of a robot that goes on, or
        came, as at the end.
        """
        part = slice(since, self.steps)
        time_s, poses = self._time_s[part], self._poses[part]
        settings, footprint = self._settings, self._robot.footprint
        ground, slope = follow_ground(self._world.ground, footprint, poses)
        gait = walk(settings.gait, self._commands[part], time_s)
        tilts = stumble_tilts(self._stumbling.stumbles, settings.mechanics.stumble_s, time_s)
        height = ground + self._robot.base_height + gait.height
        attitude = np.column_stack([slope + gait.tilt + tilts, poses[:, 2]])
        contacts = self.contacts(since)
        measured, odometry = self.odometry()
        specific_force = felt_acceleration(self._velocity[part], contacts.impact, height, attitude)
        return Drive(
            time_s,
            np.column_stack([poses[:, :2], height]),
            attitude,
            self._velocity[part].copy(),
            self._commands[part].copy(),
            measured[part],
            odometry[part],
            specific_force + gait.bumps,
            body_rates(attitude),
            contacts,
        )

    def contacts(self, since: int = 0) -> Contacts:
        """What has touched the robot, from a step on."""
        steps, lasting = self._steps[since:], self._settings.mechanics.stumble_s
        return Contacts(
            np.array([step.stopped for step in steps]),
            np.array([step.impact for step in steps]),
            np.array([step.speed_share for step in steps]),
            np.array([step.entangled for step in steps]),
            stumbling_at(self._stumbling.stumbles, lasting, self.steps)[since:],
        )
