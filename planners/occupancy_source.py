"""An occupancy map of the latest cloud, inflated, for a planner."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from graspe_data.geometry import Transform
from graspe_data.manifest import Settings
from graspe_data.observation.intensity_map import InflationSettings, inflate, inflation_kernel
from graspe_data.robot import Robot
from planners.cost_map import CostMap
from planners.lidar_clouds import LidarClouds, sound_mounting
from planners.occupancy_map import OccupancyMapSettings, occupancy_map
from planners.pose_at import pose_at
from planners.situation import Situation

Pose = tuple[float, float, float]


class OccupancySettings(Settings):
    """From a cloud to an inflated occupancy map."""

    occupancy: OccupancyMapSettings = OccupancyMapSettings()
    reach: Annotated[int, Field(ge=0, le=50)] = 5
    """Cells by which obstacles are inflated to all sides, as a square."""


class OccupancySource:
    """An occupancy map as a ``MapSource``: occupied cells cost 1, inflated; nothing is remembered.

    Intensities are not looked at.
    """

    def __init__(
        self, robot: Robot, base_from_lidar: Transform, settings: OccupancySettings | None = None
    ) -> None:
        """Take the lidar's mounting."""
        self._robot, self._mounting = robot, sound_mounting(base_from_lidar)
        self._settings, self._clouds = settings or OccupancySettings(), LidarClouds.of(robot)

    def cost_map(self, situation: Situation) -> CostMap:
        """See ``MapSource``."""
        least = self._robot.lidar.minimum_range
        stamp_ns = self._clouds.cloud(situation, self._mounting, least).stamp_ns
        pose = pose_at(situation, stamp_ns)
        return inflated_occupancy(self.occupied(situation), pose, stamp_ns, self._settings)

    def occupied(self, situation: Situation) -> NDArray[np.bool_]:
        """The occupied cells, bool (n, n), row 0 ahead and column 0 left, base_link.

        Raises:
            PlannerError: There is no cloud; see ``LidarClouds``.
        """
        least = self._robot.lidar.minimum_range
        xyz = self._clouds.in_base(situation, self._mounting, least)
        made = occupancy_map(xyz, self._robot.base_height, self._settings.occupancy)
        return made.occupied[::-1, ::-1]


def inflated_occupancy(
    occupied: NDArray[np.bool_], pose: Pose, stamp_ns: int, settings: OccupancySettings
) -> CostMap:
    """Inflate occupied cells by a square: all that is inflated costs 1 and is barred.

    Args:
        occupied: bool (n, n), row 0 ahead, column 0 left.
        pose: Of the map, x, y in metres and yaw in rad, odometry frame.
        stamp_ns: Of the map.
        settings: The inflation and the size of a cell.
    """
    square = InflationSettings(form="uniform", cells=2 * settings.reach + 1)
    cost = inflate(occupied.astype(np.float32), inflation_kernel((1.0, 0.0), square))
    return CostMap(cost, cost > 0, occupied, settings.occupancy.resolution, pose, stamp_ns)
