"""An occupancy map with the glass that intensity peaks have shown so far, for a planner."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from graspe_data.arrays import Mask
from graspe_data.errors import ObservationError, PlannerError
from graspe_data.geometry import Transform
from graspe_data.observation.intensity_map.strength import IntensityScale
from graspe_data.robot import Robot
from graspe_data.sensor_data import PointCloud
from planners.cost_map import CostMap, cells_at
from planners.glass_peaks import PeakSettings, glass_peaks
from planners.lidar_clouds import LidarClouds, sound_mounting
from planners.occupancy_source import OccupancySettings, OccupancySource, inflated_occupancy
from planners.pose_at import pose_at
from planners.situation import Pose, Situation

COUNTS = 255.0
"""Full scale of the intensities that ``PeakSettings`` counts in."""

Points = NDArray[np.float64]


class GlassSlamSettings(OccupancySettings):
    """The occupancy map, and what counts as a peak."""

    peaks: PeakSettings = PeakSettings()


class GlassSlamSource:
    """``OccupancySource`` with the glass of all clouds so far, as a ``MapSource``.

    As Wang and Wang flag their grid's cells: what was once found to be glass stays occupied,
    whatever beams pass through it later. The glass lies where odometry says; no scan matching
    corrects its drift.
    """

    def __init__(
        self, robot: Robot, base_from_lidar: Transform, settings: GlassSlamSettings | None = None
    ) -> None:
        """Take the lidar's mounting and scale."""
        self._robot, self._mounting = robot, sound_mounting(base_from_lidar)
        self._settings = settings or GlassSlamSettings()
        self._occupancy = OccupancySource(robot, base_from_lidar, self._settings)
        self._clouds = LidarClouds.of(robot)
        self._scale = IntensityScale(robot.lidar.intensity_maximum)
        self._glass: set[tuple[int, int]] = set()
        self._last: CostMap | None = None
        self._mapped: PointCloud | None = None

    def cost_map(self, situation: Situation) -> CostMap:
        """See ``MapSource``.

        Raises:
            PlannerError: There is no cloud, or its intensity cannot be used.
        """
        least = self._robot.lidar.minimum_range
        cloud = self._clouds.cloud(situation, self._mounting, least)
        stamp_ns = cloud.stamp_ns
        if self._last is None or situation.cloud is not self._mapped:
            if self._last is not None and stamp_ns < self._last.stamp_ns:
                self._glass.clear()
            pose = pose_at(situation, stamp_ns)
            self._remember(cloud, pose)
            occupied = self._with_glass(self._occupancy.occupied(situation), pose)
            self._last = inflated_occupancy(occupied, pose, stamp_ns, self._settings)
            self._mapped = situation.cloud
        return self._last

    def _remember(self, cloud: PointCloud, pose: Pose) -> None:
        """Add the cells of the odometry frame in which the cloud shows glass."""
        points = self._mounting.apply(self._peaks(cloud))[:, :2]
        places = points @ _turn(pose).T + pose[:2]
        cells = np.floor(places / self._settings.occupancy.resolution).astype(np.int64)
        self._glass.update((x, y) for x, y in cells.tolist())

    def _peaks(self, cloud: PointCloud) -> Points:
        lidar = self._robot.lidar
        try:
            strength = self._scale.strength(cloud.intensity)
        except ObservationError as error:
            raise PlannerError(f"no map: {error}") from error
        least = np.einsum("ij,ij->i", cloud.xyz, cloud.xyz) >= lidar.minimum_range**2
        ring = None if cloud.ring is None else cloud.ring[least]
        scaled = strength[least] * np.float32(COUNTS / lidar.intensity_maximum)
        scaled_cloud = PointCloud(cloud.stamp_ns, cloud.frame, cloud.xyz[least], scaled, ring)
        return glass_peaks(scaled_cloud, lidar.rings, self._settings.peaks)

    def _with_glass(self, occupied: Mask, pose: Pose) -> Mask:
        """The map with the remembered cells that lie on it."""
        cell_m, marked = self._settings.occupancy.resolution, occupied.copy()
        centres = (np.array(sorted(self._glass)).reshape(-1, 2) + 0.5) * cell_m
        row, column = cells_at((centres - pose[:2]) @ _turn(pose), len(marked), cell_m)
        side = len(marked)
        inside = (row >= 0) & (row < side) & (column >= 0) & (column < side)
        marked[row[inside], column[inside]] = True
        return marked


def _turn(pose: Pose) -> Points:
    """The rotation (2, 2) of base_link in the odometry frame."""
    cosine, sine = np.cos(pose[2]), np.sin(pose[2])
    return np.array([[cosine, -sine], [sine, cosine]])
