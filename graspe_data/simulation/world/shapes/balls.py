"""A ball of triangles, to be dented into rocks or drawn out into beads."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from graspe_data.arrays import Floats


def octahedron() -> tuple[Floats, NDArray[np.uint32]]:
    """Six corners (6, 3) on the unit sphere and eight triangles (8, 3)."""
    axes = np.eye(3)
    corners = np.stack([axes[0], axes[1], -axes[0], -axes[1], axes[2], -axes[2]])
    upper = [[k, (k + 1) % 4, 4] for k in range(4)]
    lower = [[(k + 1) % 4, k, 5] for k in range(4)]
    return corners, np.array(upper + lower, np.uint32)


def ball(finer: int) -> tuple[Floats, NDArray[np.uint32]]:
    """Corners (V, 3) on the unit sphere and triangles (8 * 4 ** finer, 3)."""
    corners, faces = octahedron()
    for _ in range(finer):
        corners, faces = _halved(corners, faces)
    return corners, faces


def _halved(corners: Floats, faces: NDArray[np.uint32]) -> tuple[Floats, NDArray[np.uint32]]:
    edges = np.sort(faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    unique, which = np.unique(edges, axis=0, return_inverse=True)
    middle = corners[unique].mean(axis=1)
    middle /= np.linalg.norm(middle, axis=1, keepdims=True)
    a, b, c = faces.T
    ab, bc, ca = (which.reshape(-1, 3) + len(corners)).T
    parts = [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
    finer = np.concatenate([np.stack(part, axis=1) for part in parts]).astype(np.uint32)
    return np.concatenate([corners, middle]), finer
