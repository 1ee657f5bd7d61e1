"""Which arcs stay in front of the camera: the restriction of V_s in GrASPE's section IV-G."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from graspe_data.geometry import Transform
from graspe_data.robot import Intrinsics


def view_bearings(intrinsics: Intrinsics, base_from_camera: Transform) -> tuple[float, float]:
    """Bearings of the picture's right and left edge at mid-height, rad, base_link.

    Args:
        intrinsics: Of the picture, without distortion.
        base_from_camera: Carries points of the optical frame into base_link.
    """
    middle = (intrinsics.height / 2 - intrinsics.cy) / intrinsics.fy
    edges = (np.array([intrinsics.width - 0.5, -0.5]) - intrinsics.cx) / intrinsics.fx
    rays = np.stack((edges, np.full(2, middle), np.ones(2)), axis=1) @ base_from_camera.rotation.T
    right, left = np.arctan2(rays[:, 1], rays[:, 0]).tolist()
    return float(right), float(left)


def stays_in_view(
    velocities: NDArray[np.float64], horizon_s: float, bearings: tuple[float, float]
) -> NDArray[np.bool_]:
    """Tell which roll-outs end within the camera's field of view, or turn on the spot.

    Pure rotations are kept. The chord of an arc of constant velocity has the bearing
    omega t / 2, whatever its length, so an arc leaves the view where that passes an edge. What
    drives backwards is behind the camera.

    Args:
        velocities: float64 (K, 2), m/s and rad/s.
        horizon_s: Length of the roll-out.
        bearings: See ``view_bearings``.

    Returns:
        bool (K,).
    """
    chord = velocities[:, 1] * horizon_s / 2
    seen = (velocities[:, 0] > 0) & (chord >= bearings[0]) & (chord <= bearings[1])
    kept: NDArray[np.bool_] = seen | (velocities[:, 0] == 0)
    return kept
