"""Leaves."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from graspe_data.simulation.world.materials import MaterialName
from graspe_data.simulation.world.mesh import Mesh, mesh_of

LEAF_TRIANGLES = 2


def leaf_area(length: float, width: float) -> float:
    """One-sided area in m2 of a leaf, which is a rhombus."""
    return length * width / 2


def leaves(
    centres: NDArray[np.floating],
    length: float,
    width: float,
    material: MaterialName,
    generator: np.random.Generator,
) -> Mesh:
    """Flat leaves around N centres (N, 3), metres, oriented uniformly at random.

    The normals are distributed over the sphere evenly, so that a leaf's mean area as seen from
    any direction is half of its own: G = 1/2 (Ross 1981).
    """
    along = _unit(generator.standard_normal((len(centres), 3), dtype=np.float32))
    other = generator.standard_normal((len(centres), 3), dtype=np.float32)
    across = _unit(np.cross(along, other))
    along *= np.float32(length / 2)
    across *= np.float32(width / 2)
    middle = centres.astype(np.float32)
    corners = np.stack([middle - along, middle + across, middle + along, middle - across], axis=1)
    first = 4 * np.arange(len(centres), dtype=np.uint32)[:, None, None]
    faces = first + np.array([[0, 1, 2], [0, 2, 3]], np.uint32)
    return mesh_of(corners.reshape(-1, 3), faces.reshape(-1, 3), material)


def _unit(vectors: NDArray[np.float32]) -> NDArray[np.float32]:
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    unit: NDArray[np.float32] = vectors / np.maximum(length, np.float32(1e-12))
    return unit
