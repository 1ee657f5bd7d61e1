"""Rays against the surfaces of a world."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import open3d as o3d
from numpy.typing import NDArray

from graspe_data.simulation.world.mesh import Mesh

NOTHING = 255
"""The material of a ray that hits nothing."""


@dataclass(frozen=True)
class Hits:
    """Where N rays end.

    ``distance`` float32 (N,), in lengths of the direction given, inf where nothing is hit;
    ``normal`` float32 (N, 3), unit, on the side that the ray comes from; ``material`` uint8 (N,),
    ``NOTHING`` where nothing is hit; ``face`` uint32 (N,), the triangle.
    """

    distance: NDArray[np.float32]
    normal: NDArray[np.float32]
    material: NDArray[np.uint8]
    face: NDArray[np.uint32]


class RayScene:
    """A mesh, made ready for rays (Embree through Open3D's RaycastingScene)."""

    def __init__(self, mesh: Mesh, threads: int = 0) -> None:
        """Index the triangles; ``threads`` 0 uses every core for each call."""
        self._threads = threads
        self._materials = np.append(mesh.material, np.uint8(NOTHING))
        self._scene: Any = o3d.t.geometry.RaycastingScene()
        self._scene.add_triangles(_tensor(mesh.vertices), _tensor(mesh.faces))

    def cast(self, origins: NDArray[np.floating], directions: NDArray[np.floating]) -> Hits:
        """Follow rays to the first surface.

        Args:
            origins: (N, 3), or (3,) for all; metres.
            directions: (N, 3), unit vectors.
        """
        rays = _rays(origins, directions)
        found = self._scene.cast_rays(_tensor(rays), nthreads=self._threads)
        normal = found["primitive_normals"].numpy()
        away = np.einsum("nk,nk->n", normal, rays[:, 3:]) > 0
        np.negative(normal, out=normal, where=away[:, None])
        face = found["primitive_ids"].numpy()
        known = np.minimum(face, len(self._materials) - 1)
        return Hits(found["t_hit"].numpy(), normal, self._materials[known], face)

    def blocked(
        self,
        origins: NDArray[np.floating],
        directions: NDArray[np.floating],
        reach: float = np.inf,
    ) -> NDArray[np.bool_]:
        """Whether anything stands in the way of each ray within a reach in metres (N,)."""
        rays = _rays(origins, directions)
        met = self._scene.test_occlusions(
            _tensor(rays), tnear=0.0, tfar=reach, nthreads=self._threads
        )
        answer: NDArray[np.bool_] = met.numpy()
        return answer


def _tensor(values: NDArray[Any]) -> Any:
    make: Any = o3d.core.Tensor
    return make(values)


def _rays(origins: NDArray[np.floating], directions: NDArray[np.floating]) -> NDArray[np.float32]:
    rays = np.empty((len(directions), 6), np.float32)
    rays[:, :3] = origins
    rays[:, 3:] = directions
    return rays
