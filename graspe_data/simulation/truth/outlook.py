"""Would the robot get through, had it kept its velocity?"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from graspe_data.geometry import Floats
from graspe_data.observation.labels.events import bounds_ns
from graspe_data.observation.labels.intervals import touches
from graspe_data.robot import Robot
from graspe_data.simulation.motion.arc_contacts import failure_times
from graspe_data.simulation.motion.drive import STEP_S, Drive
from graspe_data.simulation.motion.mechanics import MechanicsSettings
from graspe_data.simulation.truth.events import true_events
from graspe_data.simulation.world.world import World


def arc_success(
    world: World,
    robot: Robot,
    poses: Floats,
    velocities: Floats,
    steps: int = 10,
    step_s: float = 0.3,
    settings: MechanicsSettings | None = None,
) -> NDArray[np.bool_]:
    """Whether arcs of constant velocity get through the world, step by step, bool (P, steps).

    Step k covers the time (k step_s, (k + 1) step_s]; what fails stays failed. See
    ``failure_times`` for what fails; an arc that stands still succeeds, even beside a wall.

    Args:
        world: Obstacles.
        robot: Its footprint.
        poses: (P, 3) x, y, yaw; world frame, metres, rad.
        velocities: (P, 2) v and omega, m/s and rad/s.
        steps: Steps of an arc.
        step_s: Seconds of a step.
        settings: How contact acts.
    """
    ends = np.arange(1, steps + 1) * step_s
    fails = failure_times(
        world.obstacles,
        robot.footprint,
        poses,
        velocities,
        steps * step_s,
        settings or MechanicsSettings(),
    )
    succeeds: NDArray[np.bool_] = fails[:, None] > ends + 1e-9
    return succeeds


def anchor_success(
    world: World,
    robot: Robot,
    drive: Drive,
    times_s: Floats,
    steps: int = 10,
    step_s: float = 0.3,
    settings: MechanicsSettings | None = None,
) -> NDArray[np.bool_]:
    """As ``arc_success``, from the true poses and velocities of a drive at times (P,).

    All steps are False where a failure goes on at that time: a robot that is held, or that falls
    over a rock, does not succeed by standing still.
    """
    index = np.clip(np.rint(times_s / STEP_S).astype(np.intp), 0, len(drive.time_s) - 1)
    velocities = drive.velocity[index][:, None]
    return candidate_success(world, robot, drive, index, velocities, steps, step_s, settings)[:, 0]


def candidate_success(
    world: World,
    robot: Robot,
    drive: Drive,
    moments: NDArray[np.intp],
    velocities: Floats,
    steps: int = 10,
    step_s: float = 0.3,
    settings: MechanicsSettings | None = None,
) -> NDArray[np.bool_]:
    """As ``anchor_success``, of candidates in the robot's place, bool (P, K, steps).

    Args:
        world: Obstacles.
        robot: Its footprint.
        drive: Where the robot was, and when it failed.
        moments: Steps of the drive, (P,).
        velocities: (P, K, 2) v and omega, m/s and rad/s.
        steps: Steps of an arc.
        step_s: Seconds of a step.
        settings: How contact acts.
    """
    pictures, number, _ = velocities.shape
    poses = np.column_stack([drive.position[moments, :2], drive.attitude[moments, 2]])
    asked = np.repeat(poses, number, axis=0), velocities.reshape(-1, 2)
    success = arc_success(world, robot, *asked, steps, step_s, settings)
    stamps = np.rint(drive.time_s[moments] * 1e9).astype(np.int64)
    failing = touches(*bounds_ns(true_events(drive)), stamps - 1, stamps)
    return success.reshape(pictures, number, steps) & ~failing[:, None, None]
