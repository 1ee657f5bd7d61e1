"""Tubes along bent paths."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from graspe_data.arrays import Floats
from graspe_data.simulation.world.materials import MaterialName
from graspe_data.simulation.world.mesh import Mesh, mesh_of

UPRIGHT = 0.9


def tubes(paths: Floats, radii: Floats, sides: int, material: MaterialName) -> Mesh:
    """Open tubes around N paths of K points each.

    Args:
        paths: (N, K, 3), metres.
        radii: (N, K), metres.
        sides: Of the polygon that stands for a circle; its corners lie on the circle.
        material: Of the surface.
    """
    count, points = radii.shape
    angle = 2 * np.pi * np.arange(sides) / sides
    first, second = _across(paths[:, -1] - paths[:, 0])
    circle = first[:, None] * np.cos(angle)[:, None] + second[:, None] * np.sin(angle)[:, None]
    corners = paths[:, :, None] + radii[:, :, None, None] * circle[:, None]
    faces = tube_triangles(points, sides)[None] + np.uint32(points * sides) * np.arange(
        count, dtype=np.uint32
    ).reshape(-1, 1, 1)
    return mesh_of(corners.reshape(-1, 3), faces.reshape(-1, 3), material)


def tube_triangles(points: int, sides: int) -> NDArray[np.uint32]:
    """The triangles (2 (K - 1) sides, 3) of one tube of K points, indices of its corners."""
    here = np.arange(points * sides, dtype=np.uint32).reshape(points, sides)
    beside = np.roll(here, -1, axis=1)
    a, b, c, d = here[:-1], beside[:-1], beside[1:], here[1:]
    halves = np.stack([np.stack([a, b, c], -1), np.stack([a, c, d], -1)], axis=2)
    triangles: NDArray[np.uint32] = halves.reshape(-1, 3)
    return triangles


def _across(directions: Floats) -> tuple[Floats, Floats]:
    unit = directions / np.linalg.norm(directions, axis=1, keepdims=True)
    upright = np.abs(unit[:, 2:]) > UPRIGHT
    helper = np.where(upright, [[1.0, 0.0, 0.0]], [[0.0, 0.0, 1.0]])
    first = np.cross(helper, unit)
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    return first, np.cross(unit, first)
