"""Rigid transforms and rotations. Quaternions are (x, y, z, w), as in ROS."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from graspe_data.arrays import Floats
from graspe_data.errors import GeometryError


def rotation_from_quaternion(quaternion: Floats) -> Floats:
    """Rotation matrices (..., 3, 3) of quaternions (..., 4), normalised first.

    Raises:
        GeometryError: A quaternion has no length.
    """
    length = np.linalg.norm(quaternion, axis=-1, keepdims=True)
    if not np.all(length > np.finfo(np.float64).eps):
        raise GeometryError("A quaternion of zero length is no rotation: check the publisher.")
    x, y, z, w = np.moveaxis(quaternion / length, -1, 0)
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def quaternion_from_rotation(rotation: Floats) -> Floats:
    """Quaternions (N, 4) of rotation matrices (N, 3, 3), by the largest component."""
    m = rotation
    trace = m[:, 0, 0] + m[:, 1, 1] + m[:, 2, 2]
    squares = np.stack(
        [
            1 + 2 * m[:, 0, 0] - trace,
            1 + 2 * m[:, 1, 1] - trace,
            1 + 2 * m[:, 2, 2] - trace,
            1 + trace,
        ],
        axis=1,
    )
    sums = {
        (0, 1): m[:, 0, 1] + m[:, 1, 0],
        (0, 2): m[:, 0, 2] + m[:, 2, 0],
        (1, 2): m[:, 1, 2] + m[:, 2, 1],
        (0, 3): m[:, 2, 1] - m[:, 1, 2],
        (1, 3): m[:, 0, 2] - m[:, 2, 0],
        (2, 3): m[:, 1, 0] - m[:, 0, 1],
    }
    products = np.zeros((rotation.shape[0], 4, 4))
    for (i, j), value in sums.items():
        products[:, i, j] = products[:, j, i] = value
    products[:, range(4), range(4)] = squares
    largest = squares.argmax(axis=1)
    chosen = products[np.arange(largest.size), largest]
    unit: Floats = chosen / np.linalg.norm(chosen, axis=1, keepdims=True)
    return unit


def roll_pitch_yaw(rotation: Floats) -> tuple[Floats, Floats, Floats]:
    """Roll, pitch and yaw in rad, each (...), of rotation matrices (..., 3, 3); z-y-x order."""
    roll = np.arctan2(rotation[..., 2, 1], rotation[..., 2, 2])
    pitch = -np.arcsin(np.clip(rotation[..., 2, 0], -1.0, 1.0))
    yaw = np.arctan2(rotation[..., 1, 0], rotation[..., 0, 0])
    return roll, pitch, yaw


def rotation_from_rpy(roll: float, pitch: float, yaw: float) -> Floats:
    """The rotation matrix (3, 3) of roll, pitch and yaw in rad; z-y-x order, as in URDF."""
    sines, cosines = np.sin((roll, pitch, yaw)), np.cos((roll, pitch, yaw))
    about_x = np.array([[1, 0, 0], [0, cosines[0], -sines[0]], [0, sines[0], cosines[0]]])
    about_y = np.array([[cosines[1], 0, sines[1]], [0, 1, 0], [-sines[1], 0, cosines[1]]])
    about_z = np.array([[cosines[2], -sines[2], 0], [sines[2], cosines[2], 0], [0, 0, 1]])
    return np.asarray(about_z @ about_y @ about_x, dtype=np.float64)


@dataclass(frozen=True)
class Transform:
    """A rigid transform that carries points of a child frame into its parent frame.

    ``rotation``: float64 (3, 3). ``translation``: float64 (3,), metres, in the parent frame.
    """

    rotation: Floats
    translation: Floats

    @classmethod
    def identity(cls) -> Self:
        """The transform that moves nothing."""
        return cls(np.eye(3), np.zeros(3))

    @classmethod
    def from_quaternion(cls, translation: Floats, quaternion: Floats) -> Self:
        """From a translation (3,) in metres and a quaternion (4,)."""
        return cls(rotation_from_quaternion(quaternion), np.asarray(translation, np.float64))

    def __matmul__(self, inner: Transform) -> Transform:
        """This transform after ``inner``."""
        return Transform(
            self.rotation @ inner.rotation, self.rotation @ inner.translation + self.translation
        )

    def inverse(self) -> Transform:
        """The transform from the parent frame into the child frame."""
        return Transform(self.rotation.T, -self.rotation.T @ self.translation)

    def apply(self, points: NDArray[np.floating]) -> NDArray[np.floating]:
        """Carry points (..., 3) over; the dtype stays."""
        rotation = self.rotation.astype(points.dtype)
        moved: NDArray[np.floating] = points @ rotation.T + self.translation.astype(points.dtype)
        return moved


def plain_frame(name: str) -> str:
    """A frame's name without the leading slash of old recordings."""
    return name.lstrip("/")


def move_points(xyz: NDArray[np.float32], transform: Transform) -> NDArray[np.float32]:
    """Carry points (N, 3) over by sums and products alone, which every processor rounds alike."""
    x, y, z = np.ascontiguousarray(xyz.T)
    moved = np.empty((3, len(xyz)), np.float32)
    rows = np.column_stack((transform.rotation, transform.translation)).astype(np.float32)
    for axis, (a, b, c, shift) in enumerate(rows):
        np.multiply(a, x, out=moved[axis])
        moved[axis] += b * y
        moved[axis] += c * z
        moved[axis] += shift
    return moved.T
