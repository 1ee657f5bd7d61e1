"""Obstacles for a planner: points on the ground, out of a laser scan."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from graspe_data.arrays import Floats
from graspe_data.geometry import Transform
from graspe_data.observation.laser_scan import LaserScanSettings, laser_scan
from planners.lidar_clouds import LidarClouds, sound_mounting
from planners.situation import Situation

_ALL_AROUND = 3.1
"""rad to each side."""


class ObstacleSource(Protocol):
    """Finds what a robot must not touch."""

    def points(self, situation: Situation) -> Floats:
        """Obstacles float64 (N, 2), metres, base_link.

        Raises:
            PlannerError: There is no cloud to find them in; see ``LidarClouds``.
        """
        ...

    @property
    def sees_behind(self) -> bool:
        """Whether obstacles behind the robot are among them; else it must not drive backwards."""
        ...


def scan_points(scan: NDArray[np.float32], half_angle: float) -> Floats:
    """End points (N, 2) of the rays that hit something, metres, base_link.

    Args:
        scan: float32 (rays,), from right to left; inf where a ray is empty. See ``laser_scan``.
        half_angle: The scan spans [-half_angle, half_angle), rad.
    """
    ray = np.flatnonzero(np.isfinite(scan))
    angle = (ray + 0.5) * (2 * half_angle / len(scan)) - half_angle
    directions = np.stack((np.cos(angle), np.sin(angle)), axis=1)
    return np.asarray(scan[ray, None] * directions, np.float64)


class ScanObstacles:
    """What a planar scan of the cloud hits."""

    def __init__(
        self,
        base_from_lidar: Transform,
        base_height: float,
        minimum_range: float = 0.0,
        settings: LaserScanSettings | None = None,
        clouds: LidarClouds | None = None,
    ) -> None:
        """Take the lidar's mounting.

        Args:
            base_from_lidar: Carries points of the lidar into base_link.
            base_height: Height of base_link above the ground, metres.
            minimum_range: Returns nearer to the lidar hit the robot itself, metres.
            settings: The band and the rays; None for the dataset's own.
            clouds: Which clouds are the lidar's; None takes the first one's frame for its own.
        """
        self._mounting, self._base_height = sound_mounting(base_from_lidar), base_height
        self._minimum_range, self._clouds = minimum_range, clouds or LidarClouds()
        self._settings = settings or LaserScanSettings()

    def points(self, situation: Situation) -> Floats:
        """See ``ObstacleSource``."""
        xyz = self._clouds.in_base(situation, self._mounting, self._minimum_range)
        scan = laser_scan(xyz, self._base_height, self._settings)
        return scan_points(scan, self._settings.half_angle)

    @property
    def sees_behind(self) -> bool:
        """See ``ObstacleSource``."""
        return self._settings.half_angle >= _ALL_AROUND
