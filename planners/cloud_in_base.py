"""A situation's cloud as the robot's base sees it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from graspe_data.errors import PlannerError
from graspe_data.geometry import Transform
from graspe_data.sensor_data import PointCloud
from planners.situation import Situation


def cloud_of(situation: Situation) -> PointCloud:
    """The situation's cloud.

    Raises:
        PlannerError: There is none.
    """
    if situation.cloud is None:
        raise PlannerError("no cloud: obstacles are found in the lidar's latest cloud.")
    return situation.cloud


def points_in_base(
    cloud: PointCloud, mounting: Transform, minimum_range: float
) -> NDArray[np.float32]:
    """The cloud's points (N, 3), metres, base_link.

    Args:
        cloud: In the lidar's frame.
        mounting: Carries points of the lidar into base_link.
        minimum_range: Returns nearer to the lidar hit the robot itself, metres.
    """
    xyz = cloud.xyz
    kept = xyz[np.einsum("ij,ij->i", xyz, xyz) >= minimum_range**2]
    return np.asarray(mounting.apply(kept), np.float32)
