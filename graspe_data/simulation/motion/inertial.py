"""How the body is held in a drive, and what an inertial sensor in base_link feels of it."""

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
    # Where the four feet stand: front left, front right, rear left, rear right.
    forward = np.array([along, along, -along, -along])
    left = np.array([across, -across, across, -across])
    x = poses[:, :1] + cosine * forward - sine * left
    y = poses[:, 1:2] + sine * forward + cosine * left
    feet = _smooth(ground.height(x, y))
    # Roll and pitch of the plane through them.
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


GRAVITY = 9.81
# An impact lasts 30 ms: a half sine, sampled, of sum 1.
PULSE = np.sin(np.pi * (np.arange(3) + 0.5) / 3) / np.sin(np.pi * (np.arange(3) + 0.5) / 3).sum()


def felt_acceleration(velocity: Floats, impact: Floats, height: Floats, attitude: Floats) -> Floats:
    """Specific force in base_link (N, 3), m/s^2, gravity included.

    An impact's loss of speed is spread over 30 ms; all other changes are taken as they are.

    Args:
        velocity: (N, 2) v and omega, m/s and rad/s.
        impact: (N,), above 0 at the steps of an impact.
        height: (N,), of base_link, metres.
        attitude: (N, 3) roll, pitch, yaw, rad.
    """
    change = np.diff(velocity[:, 0], prepend=velocity[:1, 0]) / STEP_S
    hit = impact > 0
    along = np.where(hit, 0.0, change)
    along += np.convolve(np.where(hit, change, 0.0), PULSE)[: len(change)]
    across = velocity[:, 0] * velocity[:, 1]
    up = np.gradient(np.gradient(height, STEP_S), STEP_S) + GRAVITY
    (sin_roll, sin_pitch), (cos_roll, cos_pitch) = np.sin(attitude.T[:2]), np.cos(attitude.T[:2])
    # The transposed rotations about x and y (z-y-x order), applied to (along, across, up).
    down = sin_pitch * along + cos_pitch * up
    return np.stack(
        [
            cos_pitch * along - sin_pitch * up,
            cos_roll * across + sin_roll * down,
            cos_roll * down - sin_roll * across,
        ],
        axis=1,
    )


def body_rates(attitude: Floats) -> Floats:
    """Angular velocity in base_link (N, 3), rad/s, of roll, pitch and yaw (N, 3), unwrapped."""
    roll_rate, pitch_rate, yaw_rate = np.gradient(attitude, STEP_S, axis=0).T
    (sin_roll, sin_pitch), (cos_roll, cos_pitch) = np.sin(attitude.T[:2]), np.cos(attitude.T[:2])
    return np.stack(
        [
            roll_rate - yaw_rate * sin_pitch,
            pitch_rate * cos_roll + yaw_rate * sin_roll * cos_pitch,
            yaw_rate * cos_roll * cos_pitch - pitch_rate * sin_roll,
        ],
        axis=1,
    )
