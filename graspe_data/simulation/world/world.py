"""A world: surfaces for the sensors, obstacles for the robot, and the ground under both."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from graspe_data.arrays import Floats, Mask
from graspe_data.simulation.world.materials import Material
from graspe_data.simulation.world.mesh import Mesh
from graspe_data.simulation.world.obstacles import Obstacles


@dataclass(frozen=True)
class Ground:
    """Heights (H, W) float64, metres, on a square grid of ``cell`` metres.

    Row r, column c lies at x = origin[0] + c cell, y = origin[1] + r cell. Outside of the grid
    the height of its edge goes on. ``bare``: cells (H - 1, W - 1) where a ditch shows its soil.
    """

    heights: Floats
    origin: tuple[float, float]
    cell: float
    bare: Mask | None = None

    def height(self, x: Floats, y: Floats) -> Floats:
        """Height at points, by bilinear interpolation; any shape."""
        rows, columns = self.heights.shape
        c = np.clip((x - self.origin[0]) / self.cell, 0.0, columns - 1.0)
        r = np.clip((y - self.origin[1]) / self.cell, 0.0, rows - 1.0)
        left = np.minimum(c.astype(np.intp), columns - 2)
        low = np.minimum(r.astype(np.intp), rows - 2)
        u, v = c - left, r - low
        near = self.heights[low, left] * (1 - u) + self.heights[low, left + 1] * u
        far = self.heights[low + 1, left] * (1 - u) + self.heights[low + 1, left + 1] * u
        blended: Floats = near * (1 - v) + far * v
        return blended


@dataclass(frozen=True)
class World:
    """Everything that is there; metres, x forward, y left, z up.

    ``arena``: lowest x, lowest y, highest x, highest y of the ground that the robot may use.
    ``start``: where it begins, x, y and yaw. ``materials``: what the indices in ``surfaces``
    mean.
    """

    surfaces: Mesh
    materials: tuple[Material, ...]
    obstacles: Obstacles
    ground: Ground
    arena: tuple[float, float, float, float]
    start: tuple[float, float, float]
