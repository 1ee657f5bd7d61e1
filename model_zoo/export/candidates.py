"""Candidates that a bundle is tried on: the trajectory images of a lattice of velocities."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from graspe_data.bundle_contract import BundleContract, SensorPose
from graspe_data.geometry import Transform
from graspe_data.observation.predicted_trajectory import PredictedTrajectory

SIDE = 10
_STRIDE = 37


def candidate_images(contract: BundleContract) -> NDArray[np.uint8]:
    """Draw 100 candidates, from the robot's slowest to its fastest, left to right, well mixed.

    Args:
        contract: Of the bundle; where it does not know the camera, oblique bands stand for arcs.

    Returns:
        uint8 (100, H, W): 1 on the trajectory.
    """
    limits = contract.robot.limits
    lattice = np.stack(
        np.meshgrid(
            np.linspace(*limits.linear_velocity, SIDE), np.linspace(*limits.yaw_rate, SIDE)
        ),
        axis=-1,
    ).reshape(-1, 2)
    # The stride has no factor in common with their number, so each comes once.
    mixed = lattice[np.arange(len(lattice)) * _STRIDE % len(lattice)]
    height, width = contract.observation.picture_size
    camera, pose = contract.robot.camera, contract.robot.base_from_camera
    if camera is None or pose is None:
        return np.stack([_band(height, width, v, omega) for v, omega in mixed.tolist()])
    drawing = PredictedTrajectory(
        intrinsics=camera,
        base_from_camera=_transform(pose),
        base_height=contract.robot.base_height,
        line_width=contract.robot.footprint.width,
        steps=contract.observation.horizon_steps,
        step_s=contract.observation.horizon_step_s,
        behind=contract.observation.drawn_from_behind,
    )
    return np.stack([drawing.draw(v, omega).view(np.uint8) for v, omega in mixed.tolist()])


def _band(height: int, width: int, v: float, omega: float) -> NDArray[np.uint8]:
    """A band from the middle of the lower edge, as long as v and as oblique as the yaw rate."""
    rows, columns = np.ogrid[:height, :width]
    up = height - 1 - rows
    aside = np.abs(columns - width / 2 + up * omega) < width / 16
    return np.asarray(aside & (up < height * min(1.0, abs(v)) / 2), np.uint8)


def _transform(pose: SensorPose) -> Transform:
    return Transform(np.array(pose.rotation), np.array(pose.translation))
