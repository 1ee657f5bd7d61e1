"""An occupancy map of the latest cloud, inflated, for a planner."""

from __future__ import annotations

from typing import Annotated, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from graspe_data.arrays import Mask
from graspe_data.geometry import Transform
from graspe_data.manifest import Settings
from graspe_data.observation.intensity_map import InflationSettings, inflate, inflation_kernel
from graspe_data.robot import Robot
from planners.cost_map import CostMap
from planners.lidar_clouds import LidarClouds, sound_mounting
from planners.pose_at import pose_at
from planners.situation import Pose, Situation


class OccupancyMapSettings(Settings):
    """The map's size and what fills a cell; metres, heights above the ground."""

    size: Annotated[int, Field(ge=1, le=4096)] = 200
    """Cells along each side; the groups use 200."""
    resolution: Annotated[float, Field(gt=0, le=10)] = 0.05
    """Side of a cell; the groups use 0.05."""
    minimum_height: float = 0.15
    maximum_height: float = 1.2
    minimum_points: Annotated[int, Field(ge=1)] = 2
    """Returns that fill a cell; a single one may be noise."""

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        low, high = self.minimum_height, self.maximum_height
        if low > high:
            raise ValueError(f"minimum_height {low} is above maximum_height {high}")
        return self


def occupied_cells(
    xyz: NDArray[np.floating], base_height: float, settings: OccupancyMapSettings
) -> Mask:
    """The cells that hold returns within a band of height, bool (S, S), row 0 ahead, column 0 left.

    base_link is the corner in the middle.

    Args:
        xyz: Points (N, 3), metres, base_link.
        base_height: Height of base_link above the ground, metres.
        settings: Size and band.
    """
    low, high = settings.minimum_height - base_height, settings.maximum_height - base_height
    standing = xyz[(xyz[:, 2] >= low) & (xyz[:, 2] <= high), :2]
    cells = np.floor(standing / settings.resolution + settings.size / 2)
    inside = np.all((cells >= 0) & (cells < settings.size), axis=1)
    row, column = cells[inside].astype(np.int64).T
    shape = (settings.size, settings.size)
    counts = np.bincount(row * settings.size + column, minlength=settings.size**2).reshape(shape)
    return (counts >= settings.minimum_points)[::-1, ::-1]


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

    def occupied(self, situation: Situation) -> Mask:
        """The occupied cells, bool (n, n), row 0 ahead and column 0 left, base_link.

        Raises:
            PlannerError: There is no cloud; see ``LidarClouds``.
        """
        least = self._robot.lidar.minimum_range
        xyz = self._clouds.in_base(situation, self._mounting, least)
        return occupied_cells(xyz, self._robot.base_height, self._settings.occupancy)


def inflated_occupancy(
    occupied: Mask, pose: Pose, stamp_ns: int, settings: OccupancySettings
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
