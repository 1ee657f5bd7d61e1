"""From a robot on its way to what its planner is asked with."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from graspe_data.geometry import Transform, roll_pitch_yaw
from graspe_data.sensor_data import Motion
from graspe_data.simulation.field import Field
from graspe_data.simulation.live_odometry import LiveOdometry
from graspe_data.simulation.live_sensors import LiveSensors
from graspe_data.simulation.message_stream import stamp_of
from graspe_data.simulation.motion.drive_in_progress import DriveInProgress
from planners.situation import Situation


@dataclass(frozen=True)
class Senses:
    """Which sensors a planner looks at; the others are not simulated."""

    camera: bool = True
    lidar: bool = True


class Situations:
    """Asks the simulated robot's sensors for what its planner needs.

    The planner knows its pose by odometry alone, whose frame is the robot's start, and the goal in
    that frame.
    """

    def __init__(
        self, field: Field, goal: tuple[float, float], senses: Senses, history_s: float
    ) -> None:
        """Take the goal, x and y in metres in the world."""
        self._senses = senses
        self._sensors = LiveSensors(field)
        self._odometry = LiveOdometry(field.robot, field.scenario.rates.odometry, history_s)
        self._goal = _seen_from(field.world.start, goal)

    def now(self, way: DriveInProgress) -> Situation:
        """The situation at the next step; at least two steps have to be taken."""
        motions = self._odometry.motions(way)
        last = motions[-1]
        return Situation(
            now_ns=stamp_of(way.steps),
            pose=_planar(last),
            velocity=(last.linear_velocity or 0.0, last.yaw_rate or 0.0),
            goal=self._goal,
            picture=self._sensors.picture(way) if self._senses.camera else None,
            cloud=self._sensors.cloud(way) if self._senses.lidar else None,
            motions=motions,
        )


def _planar(motion: Motion) -> tuple[float, float, float]:
    place, turn = np.array(motion.position), np.array(motion.quaternion)
    yaw = roll_pitch_yaw(Transform.from_quaternion(place, turn).rotation)[2]
    return float(place[0]), float(place[1]), float(yaw)


def _seen_from(start: tuple[float, float, float], goal: tuple[float, float]) -> tuple[float, float]:
    x, y = goal[0] - start[0], goal[1] - start[1]
    cosine, sine = float(np.cos(start[2])), float(np.sin(start[2]))
    return cosine * x + sine * y, cosine * y - sine * x
