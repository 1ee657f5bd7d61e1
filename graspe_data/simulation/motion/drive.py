"""A drive: what the robot did and what it was told, step by step."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from graspe_data.arrays import Floats
from graspe_data.geometry import Transform, rotation_from_rpy

STEP_S = 0.01
"""Seconds between two steps; every sensor's period is a multiple of it."""


@dataclass(frozen=True)
class Contacts:
    """What touched the robot at each of N steps.

    ``stopped`` bool: pressed against something solid. ``impact`` float64: m/s lost at once at
    this step to something solid, else 0. ``speed_share`` float64: of the commanded speed that
    vegetation leaves, 1 = free. ``entangled`` bool: inside something that entangles.
    ``stumbling`` bool: thrown off its gait by a rock.
    """

    stopped: NDArray[np.bool_]
    impact: Floats
    speed_share: Floats
    entangled: NDArray[np.bool_]
    stumbling: NDArray[np.bool_]


@dataclass(frozen=True)
class Drive:
    """A drive at N steps of ``STEP_S``, float64, SI units; the true state in the world frame.

    ``time_s`` (N,). ``position`` (N, 3) of base_link. ``attitude`` (N, 3) roll, pitch, yaw.
    ``velocity`` (N, 2) v, omega as they were. ``command`` (N, 2) v, omega as asked.
    ``measured`` (N, 2) v, omega as the odometry reports them. ``odometry`` (N, 3) x, y, yaw as
    the odometry reports them, from 0. ``acceleration``, ``gyro`` (N, 3) as an ideal IMU in
    base_link feels them, gravity included. ``contacts``: what touched it.
    """

    time_s: Floats
    position: Floats
    attitude: Floats
    velocity: Floats
    command: Floats
    measured: Floats
    odometry: Floats
    acceleration: Floats
    gyro: Floats
    contacts: Contacts

    def base_pose(self, time_s: float) -> Transform:
        """base_link in the world at a time, between steps by linear interpolation."""
        place = np.array([np.interp(time_s, self.time_s, axis) for axis in self.position.T])
        turn = [float(np.interp(time_s, self.time_s, angle)) for angle in self.attitude.T]
        return Transform(rotation_from_rpy(*turn), place)
