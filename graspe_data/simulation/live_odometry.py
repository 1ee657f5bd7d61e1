"""What the odometry has reported while the robot drives."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from graspe_data.robot import Robot
from graspe_data.sensor_data import Motion
from graspe_data.simulation.message_stream import stamp_of
from graspe_data.simulation.motion.drive import STEP_S
from graspe_data.simulation.motion.drive_in_progress import DriveInProgress


class LiveOdometry:
    """The latest reports; before the start, those of a robot that stands.

    A report is there a step after its stamp, so at any moment that of the last step is. Poses are
    level: the odometry of a recording also has the body's tilt, which no planner on the ground
    asks for.
    """

    def __init__(self, robot: Robot, rate: float, history_s: float) -> None:
        """Keep reports, ``rate`` a second, for so many seconds."""
        self._frames = (robot.odometry_frame, robot.base_frame)
        self._height = robot.base_height
        self._every = round(1 / rate / STEP_S)
        self._kept = round(history_s * rate) + 1
        self._next = 0
        standing = range(-self._kept * self._every, 0, self._every)
        self._motions = [self._motion(step, (0.0, 0.0, 0.0), (0.0, 0.0)) for step in standing]

    def motions(self, way: DriveInProgress) -> Sequence[Motion]:
        """Reports that are there, oldest first."""
        measured, poses = way.odometry()
        for step in range(self._next, way.steps, self._every):
            x, y, yaw = poses[step].tolist()
            v, omega = measured[step].tolist()
            self._motions.append(self._motion(step, (x, y, yaw), (v, omega)))
            self._next = step + self._every
        self._motions = self._motions[-self._kept :]
        return tuple(self._motions)

    def _motion(
        self, step: int, pose: tuple[float, float, float], velocity: tuple[float, float]
    ) -> Motion:
        x, y, yaw = pose
        frame, child = self._frames
        return Motion(
            stamp_ns=stamp_of(step),
            frame=frame,
            child_frame=child,
            position=(x, y, self._height),
            quaternion=(0.0, 0.0, float(np.sin(yaw / 2)), float(np.cos(yaw / 2))),
            linear_velocity=velocity[0],
            yaw_rate=velocity[1],
        )
