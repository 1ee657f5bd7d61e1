"""Flat patches that lie on the triangles of uneven ground."""

from __future__ import annotations

import numpy as np

from graspe_data.arrays import Floats
from graspe_data.simulation.world.materials import MaterialName
from graspe_data.simulation.world.mesh import Mesh, mesh_of
from graspe_data.simulation.world.plan import Spots
from graspe_data.simulation.world.world import Ground

RINGS, SPOKES = 10, 48
PATCH_TRIANGLES = SPOKES * (2 * RINGS - 1)
LIFT = 0.002
"""Metres above the ground's triangles; less than a lidar's noise shows."""
NARROWEST = 0.75
"""Of the radius, where the outline is nearest to the middle."""


def surface_height(ground: Ground, x: Floats, y: Floats) -> Floats:
    """Height of the ground's triangles at points, any shape; see ``ground.ground_mesh``."""
    rows, columns = ground.heights.shape
    c = np.clip((x - ground.origin[0]) / ground.cell, 0.0, columns - 1.0)
    r = np.clip((y - ground.origin[1]) / ground.cell, 0.0, rows - 1.0)
    left = np.minimum(c.astype(np.intp), columns - 2)
    low = np.minimum(r.astype(np.intp), rows - 2)
    u, v = c - left, r - low
    near, beside = ground.heights[low, left], ground.heights[low, left + 1]
    behind, across = ground.heights[low + 1, left], ground.heights[low + 1, left + 1]
    first = near + (beside - near) * u + (across - beside) * v
    second = near + (across - behind) * u + (behind - near) * v
    height: Floats = np.where(u >= v, first, second)
    return height


def patches(
    spots: Spots, ground: Ground, material: MaterialName, generator: np.random.Generator
) -> Mesh:
    """Patches of uneven outline within N round spots, 2 mm above the ground."""
    outline = _outlines(len(spots), generator)
    angle = 2 * np.pi * np.arange(SPOKES) / SPOKES
    share = np.arange(1, RINGS + 1) / RINGS
    reach = spots.radius[:, None, None] * outline[:, None] * share[:, None]
    x = spots.start[:, 0, None, None] + reach * np.cos(angle)
    y = spots.start[:, 1, None, None] + reach * np.sin(angle)
    flat = np.stack([x, y], axis=-1).reshape(len(spots), RINGS * SPOKES, 2)
    places = np.concatenate([spots.start[:, None], flat], axis=1)
    height = surface_height(ground, places[..., 0], places[..., 1]) + LIFT
    corners = np.concatenate([places, height[..., None]], axis=-1)
    first = np.uint32(1 + RINGS * SPOKES) * np.arange(len(spots), dtype=np.uint32)[:, None, None]
    return mesh_of(corners.reshape(-1, 3), (first + _faces()).reshape(-1, 3), material)


def _outlines(count: int, generator: np.random.Generator) -> Floats:
    """Shares of the radius (count, SPOKES), from ``NARROWEST`` to 1, smooth all around."""
    angle = 2 * np.pi * np.arange(SPOKES) / SPOKES
    phase = generator.uniform(0, 2 * np.pi, (count, 4, 1))
    height = generator.uniform(0.3, 1.0, (count, 4, 1)) / np.arange(1, 5)[:, None]
    wave = (height * np.sin(np.arange(2, 6)[:, None] * angle + phase)).sum(axis=1)
    low, high = wave.min(axis=1, keepdims=True), wave.max(axis=1, keepdims=True)
    outline: Floats = NARROWEST + (1 - NARROWEST) * (wave - low) / (high - low)
    return outline


def _faces() -> np.ndarray[tuple[int, int], np.dtype[np.uint32]]:
    """A fan about the middle, and rings around it, (PATCH_TRIANGLES, 3)."""
    ring = 1 + np.arange(RINGS * SPOKES, dtype=np.uint32).reshape(RINGS, SPOKES)
    beside = np.roll(ring, -1, axis=1)
    fan = np.stack([np.zeros(SPOKES, np.uint32), ring[0], beside[0]], axis=-1)
    a, b, c, d = ring[:-1], beside[:-1], beside[1:], ring[1:]
    halves = np.stack([np.stack([a, d, c], -1), np.stack([a, c, b], -1)], axis=2)
    return np.concatenate([fan, halves.reshape(-1, 3)])
