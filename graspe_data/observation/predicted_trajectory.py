"""The trajectory image of a velocity: the arc that it predicts, drawn into the robot's picture."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from graspe_data.geometry import Transform
from graspe_data.observation.trajectory_arc import constant_velocity_arc
from graspe_data.observation.trajectory_image import trajectory_image
from graspe_data.robot import Intrinsics

LARGEST_TURN = 0.05


@dataclass(frozen=True)
class PredictedTrajectory:
    """One robot's camera and horizon, ready to draw any velocity.

    ``intrinsics`` are those of the stored picture, ``base_height``, ``line_width`` and ``behind``
    metres, ``step_s`` seconds. It is drawn as a camera sees it that stands ``behind`` metres behind
    the robot's own, at the same height and pitch: a camera on a robot does not see the ground
    before its feet, and slow arcs end there.
    """

    intrinsics: Intrinsics
    base_from_camera: Transform
    base_height: float
    line_width: float
    steps: int = 10
    step_s: float = 0.3
    behind: float = 0.0

    def draw(self, v: float, omega: float) -> NDArray[np.bool_]:
        """The trajectory image, bool (H, W), of a velocity in m/s and rad/s.

        The arc is drawn in straight parts that each turn by 0.05 rad at most: at a radius of 10 m
        they leave the arc by 3 mm.
        """
        parts = max(1, math.ceil(abs(omega) * self.step_s / LARGEST_TURN))
        arc = constant_velocity_arc(v, omega, self.steps * parts, self.step_s / parts)
        mounting = self.base_from_camera
        place = mounting.translation - np.array((self.behind, 0.0, 0.0))
        return trajectory_image(
            arc,
            self.intrinsics,
            Transform(mounting.rotation, place),
            self.base_height,
            self.line_width,
        )
