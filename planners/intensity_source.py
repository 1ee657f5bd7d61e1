"""The planning map of the multi-layer intensity map, for a planner."""

from __future__ import annotations

from typing import Annotated, Self

import numpy as np
from pydantic import Field, model_validator

from graspe_data.errors import ObservationError, PlannerError
from graspe_data.geometry import Transform
from graspe_data.manifest import Settings
from graspe_data.observation.intensity_map import (
    GlassMemory,
    IntensityScale,
    LayerSettings,
    Moment,
    PlanningMap,
    PlanningMapSettings,
    ReturnSettings,
    intensity_layers,
    planning_map,
)
from graspe_data.robot import Robot
from graspe_data.sensor_data import PointCloud
from planners.cost_map import CostMap
from planners.goal import goal_seen_from
from planners.lidar_clouds import LidarClouds, sound_mounting
from planners.pose_at import pose_at
from planners.situation import Situation


class IntensityMapSettings(Settings):
    """From a cloud to the planning map."""

    layers: LayerSettings = LayerSettings()
    planning: PlanningMapSettings = PlanningMapSettings()
    solid: Annotated[float, Field(gt=0, le=1)] = 0.25
    """Of I_TP + I_FN, from which a cell is held for solid. I_TP is above Gamma, so this is how
    faint glass may be: full strength is remembered for 1.4 of its time constant."""

    @model_validator(mode="after")
    def _rims_are_solid(self) -> Self:
        rim = self.planning.classes.rim
        if rim is not None and rim < self.solid:
            raise ValueError(f"planning.classes.rim {rim:g} is below solid {self.solid:g}")
        return self


class IntensitySource:
    """Equation (11) as a ``MapSource``; glass is carried along by odometry (6), (7).

    A change of the goal counts from the next cloud on.
    """

    def __init__(
        self, robot: Robot, base_from_lidar: Transform, settings: IntensityMapSettings | None = None
    ) -> None:
        """Take the lidar's scale and mounting."""
        self._returns, self._mounting = ReturnSettings.of(robot), sound_mounting(base_from_lidar)
        self._settings = settings or IntensityMapSettings()
        self._clouds = LidarClouds.of(robot)
        self._scale = IntensityScale(robot.lidar.intensity_maximum)
        self._memory: GlassMemory | None = None
        self._least = robot.lidar.minimum_range
        self._last: CostMap | None = None
        self._mapped: PointCloud | None = None

    def cost_map(self, situation: Situation) -> CostMap:
        """See ``MapSource``.

        Raises:
            PlannerError: There is no cloud, or its intensity cannot be used.
        """
        cloud = self._clouds.cloud(situation, self._mounting, self._least)
        if self._last is None or situation.cloud is not self._mapped:
            try:
                self._last = self._map_of(situation, cloud)
                self._mapped = situation.cloud
            except ObservationError as error:
                raise PlannerError(f"no planning map: {error}") from error
        return self._last

    def _map_of(self, situation: Situation, cloud: PointCloud) -> CostMap:
        settings, pose = self._settings, pose_at(situation, cloud.stamp_ns)
        x, y = goal_seen_from(pose, situation.goal).tolist()
        layers = intensity_layers(
            cloud, self._mounting, self._returns, settings.layers, self._scale
        )
        eye, cell = self._mounting.translation[:2].tolist(), settings.layers.grid.cell_m
        moment = Moment(cloud.stamp_ns, pose, (x, y), (eye[0], eye[1]))
        result = planning_map(layers, moment, self._memory, cell, settings.planning)
        self._memory = result.memory
        return _cost_map(result, moment, cell, settings.solid)


def _cost_map(result: PlanningMap, moment: Moment, cell_m: float, solid: float) -> CostMap:
    """Thresholds before and after the inflation agree: a dilation is a maximum."""
    return CostMap(
        cost=result.cost,
        barred=result.inflated >= np.float32(solid),
        solid=result.classes.true_positive + result.glass >= np.float32(solid),
        cell_m=cell_m,
        pose=moment.pose,
        stamp_ns=moment.stamp_ns,
    )
