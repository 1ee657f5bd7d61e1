"""Would the robot get through, had it kept its velocity, or a command?"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from graspe_data.arrays import Floats, Mask
from graspe_data.observation.labels.events import bounds_ns, touches
from graspe_data.robot import Robot
from graspe_data.simulation.motion.arc_contacts import failure_times
from graspe_data.simulation.motion.commanded_arcs import commanded_failure_times
from graspe_data.simulation.motion.drive import STEP_S, Drive
from graspe_data.simulation.motion.mechanics import MechanicsSettings
from graspe_data.simulation.truth.events import true_events
from graspe_data.simulation.world.world import World


def arc_success(
    world: World,
    robot: Robot,
    poses: Floats,
    commands: Floats,
    steps: int = 10,
    step_s: float = 0.3,
    settings: MechanicsSettings | None = None,
) -> Mask:
    """Whether arcs of constant command get through the world, step by step, bool (P, steps).

    Step k covers the time (k step_s, (k + 1) step_s]; what fails stays failed. See
    ``commanded_failure_times`` for what fails; an arc that stands still succeeds, even beside a
    wall.

    Args:
        world: Obstacles.
        robot: Its footprint.
        poses: (P, 3) x, y, yaw; world frame, metres, rad.
        commands: (P, 2) v and omega, m/s and rad/s.
        steps: Steps of an arc.
        step_s: Seconds of a step.
        settings: How contact acts.
    """
    arcs = world.obstacles, robot.footprint, poses, commands
    mechanics = settings or MechanicsSettings()
    return _succeeding(commanded_failure_times(*arcs, steps * step_s, mechanics), steps, step_s)


def anchor_success(
    world: World,
    robot: Robot,
    drive: Drive,
    times_s: Floats,
    steps: int = 10,
    step_s: float = 0.3,
    settings: MechanicsSettings | None = None,
) -> Mask:
    """Would the robot get through, had it kept its velocity? From the truth at times (P,).

    That velocity is what vegetation had left of its command: see ``failure_times``. All steps are
    False where a failure goes on at that time: a robot that is held, or that falls over a rock,
    does not succeed by standing still. Bool (P, steps).
    """
    index = np.clip(np.rint(times_s / STEP_S).astype(np.intp), 0, len(drive.time_s) - 1)
    arcs = world.obstacles, robot.footprint, _poses(drive, index), drive.velocity[index]
    fails = failure_times(*arcs, steps * step_s, settings or MechanicsSettings())
    return _succeeding(fails, steps, step_s) & ~_failing(drive, index)[:, None]


def candidate_success(
    world: World,
    robot: Robot,
    drive: Drive,
    moments: NDArray[np.intp],
    commands: Floats,
    steps: int = 10,
    step_s: float = 0.3,
    settings: MechanicsSettings | None = None,
) -> Mask:
    """As ``arc_success``, in the robot's place, bool (P, K, steps); none while a failure goes on.

    Args:
        world: Obstacles.
        robot: Its footprint.
        drive: Where the robot was, and when it failed.
        moments: Steps of the drive, (P,).
        commands: (P, K, 2) v and omega, m/s and rad/s.
        steps: Steps of an arc.
        step_s: Seconds of a step.
        settings: How contact acts.
    """
    pictures, number, _ = commands.shape
    arcs = np.repeat(_poses(drive, moments), number, axis=0), commands.reshape(-1, 2)
    success = arc_success(world, robot, *arcs, steps, step_s, settings)
    return success.reshape(pictures, number, steps) & ~_failing(drive, moments)[:, None, None]


def _succeeding(fails: Floats, steps: int, step_s: float) -> Mask:
    ends = np.arange(1, steps + 1) * step_s
    succeeds: Mask = fails[:, None] > ends + 1e-9
    return succeeds


def _poses(drive: Drive, moments: NDArray[np.intp]) -> Floats:
    return np.column_stack([drive.position[moments, :2], drive.attitude[moments, 2]])


def _failing(drive: Drive, moments: NDArray[np.intp]) -> Mask:
    """Whether a failure goes on at these steps, (P,)."""
    stamps = np.rint(drive.time_s[moments] * 1e9).astype(np.int64)
    return touches(*bounds_ns(true_events(drive)), stamps - 1, stamps)
