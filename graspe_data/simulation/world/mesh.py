"""Triangles with a material each."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from graspe_data.simulation.world.materials import MATERIAL_NAMES, MaterialName


@dataclass(frozen=True)
class Mesh:
    """A surface of F triangles over V vertices.

    ``vertices`` float32 (V, 3), metres, world frame; ``faces`` uint32 (F, 3), indices of
    vertices; ``material`` uint8 (F,), indices into ``MATERIAL_NAMES``.
    """

    vertices: NDArray[np.float32]
    faces: NDArray[np.uint32]
    material: NDArray[np.uint8]


def mesh_of(
    vertices: NDArray[np.floating], faces: NDArray[np.integer], material: MaterialName
) -> Mesh:
    """A mesh of one material."""
    return Mesh(
        np.ascontiguousarray(vertices, np.float32),
        np.ascontiguousarray(faces, np.uint32),
        np.full(len(faces), MATERIAL_NAMES.index(material), np.uint8),
    )


def join_meshes(meshes: Iterable[Mesh]) -> Mesh:
    """All triangles in one mesh, in the order given."""
    parts = list(meshes)
    offsets = np.cumsum([0] + [len(part.vertices) for part in parts])[:-1]
    faces = [part.faces + np.uint32(offset) for part, offset in zip(parts, offsets, strict=True)]
    return Mesh(
        np.concatenate([np.empty((0, 3), np.float32), *(part.vertices for part in parts)]),
        np.concatenate([np.empty((0, 3), np.uint32), *faces]),
        np.concatenate([np.empty(0, np.uint8), *(part.material for part in parts)]),
    )
