"""Beams: long boxes."""

from __future__ import annotations

import numpy as np

from graspe_data.arrays import Floats
from graspe_data.simulation.world.materials import MaterialName
from graspe_data.simulation.world.mesh import Mesh, mesh_of

BEAM_TRIANGLES = 12
SIDES = np.array(
    [
        *([0, 1, 3], [0, 3, 2], [4, 7, 5], [4, 6, 7]),
        *([0, 5, 1], [0, 4, 5], [2, 3, 7], [2, 7, 6]),
        *([0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]),
    ],
    np.uint32,
)


def beams(
    starts: Floats,
    ends: Floats,
    width: Floats | float,
    height: Floats | float,
    material: MaterialName,
) -> Mesh:
    """Boxes along N segments on the plan, standing on them.

    Args:
        starts: (N, 3), metres: the middle of the lower edge of one end.
        ends: (N, 3): the same of the other end; may be higher or lower.
        width: Across, horizontally; (N,) or for all.
        height: Above the segment, (N,) or for all.
        material: Of the surface.
    """
    along = (ends - starts)[:, :2]
    along = along / np.linalg.norm(along, axis=1, keepdims=True)
    half = np.zeros_like(starts)
    half[:, 0], half[:, 1] = -along[:, 1], along[:, 0]
    half *= np.broadcast_to(np.asarray(width) / 2, len(starts))[:, None]
    up = np.zeros_like(starts)
    up[:, 2] = height
    low = [starts - half, starts + half, ends - half, ends + half]
    corners = np.stack([*low, *(corner + up for corner in low)], axis=1)
    first = 8 * np.arange(len(starts), dtype=np.uint32)[:, None, None]
    return mesh_of(corners.reshape(-1, 3), (first + SIDES).reshape(-1, 3), material)
