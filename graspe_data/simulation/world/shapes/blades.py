"""Blades of grass."""

from __future__ import annotations

import numpy as np

from graspe_data.arrays import Floats
from graspe_data.simulation.world.materials import MaterialName
from graspe_data.simulation.world.mesh import Mesh, mesh_of

BLADE_TRIANGLES = 3
KNEE = 0.6
FULLNESS = (1 + KNEE) / 2
"""A blade's one-sided area as a share of its width times its height."""


def blades(
    feet: Floats,
    heights: Floats,
    width: float,
    lean: float,
    material: MaterialName,
    generator: np.random.Generator,
) -> Mesh:
    """Upright blades on N feet (N, 3) of N heights, metres, facing random azimuths.

    A blade keeps its width up to 0.6 of its height and ends in a point. It bends over its flat
    side, its tip by up to ``lean`` times its height; its shadow on upright planes, and so
    G = 2 / pi along horizontal paths (Ross 1981), does not change with that.
    """
    azimuth = generator.uniform(0, 2 * np.pi, len(feet))
    bend = generator.uniform(0, lean, len(feet)) * heights
    half = np.zeros((len(feet), 3), np.float32)
    half[:, 0], half[:, 1] = width / 2 * np.cos(azimuth), width / 2 * np.sin(azimuth)
    knee, tip = (np.array(feet, np.float32) for _ in range(2))
    for point, share, over in ((knee, KNEE, KNEE**2), (tip, 1.0, 1.0)):
        point[:, 0] -= over * bend * np.sin(azimuth)
        point[:, 1] += over * bend * np.cos(azimuth)
        point[:, 2] += share * heights
    foot = feet.astype(np.float32)
    corners = np.stack([foot - half, foot + half, knee - half, knee + half, tip], axis=1)
    first = 5 * np.arange(len(feet), dtype=np.uint32)[:, None, None]
    faces = first + np.array([[0, 1, 3], [0, 3, 2], [2, 3, 4]], np.uint32)
    return mesh_of(corners.reshape(-1, 3), faces.reshape(-1, 3), material)
