"""How the body stands on uneven ground."""

from __future__ import annotations

import numpy as np

from graspe_data.arrays import Floats
from graspe_data.robot import Footprint
from graspe_data.simulation.motion.drive import STEP_S
from graspe_data.simulation.world.world import Ground

SUSPENSION_S = 0.08


def follow_ground(ground: Ground, footprint: Footprint, poses: Floats) -> tuple[Floats, Floats]:
    """Height of the ground under the body, and its roll and pitch.

    Differences of the heights under four feet at the corners of the footprint, smoothed by the
    legs over ``SUSPENSION_S`` (standard deviation of a Gaussian).

    Args:
        ground: Heights.
        footprint: Where the feet stand.
        poses: (N, 3) x, y, yaw at steps of ``STEP_S``.

    Returns:
        Metres (N,), and roll and pitch (N, 2) in rad.
    """
    along, across = footprint.length / 2, footprint.width / 2
    cosine, sine = np.cos(poses[:, 2:]), np.sin(poses[:, 2:])
    forward = np.array([along, along, -along, -along])
    left = np.array([across, -across, across, -across])
    x = poses[:, :1] + cosine * forward - sine * left
    y = poses[:, 1:2] + sine * forward + cosine * left
    feet = _smooth(ground.height(x, y))
    front, rear = feet[:, :2].mean(axis=1), feet[:, 2:].mean(axis=1)
    port, starboard = feet[:, ::2].mean(axis=1), feet[:, 1::2].mean(axis=1)
    roll = np.arctan2(port - starboard, footprint.width)
    pitch = np.arctan2(rear - front, footprint.length)
    return feet.mean(axis=1), np.stack([roll, pitch], axis=1)


def _smooth(values: Floats) -> Floats:
    """Columns (N, K) under a Gaussian; the ends go on as they are."""
    reach = round(4 * SUSPENSION_S / STEP_S)
    weights = np.exp(-0.5 * (np.arange(-reach, reach + 1) * STEP_S / SUSPENSION_S) ** 2)
    weights /= weights.sum()
    wide = np.pad(values, ((reach, reach), (0, 0)), mode="edge")
    return np.stack([np.convolve(column, weights, mode="valid") for column in wide.T], axis=1)
