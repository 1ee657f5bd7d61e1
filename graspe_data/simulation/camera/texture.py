"""The grain of surfaces, looked up by place."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from graspe_data.simulation.world.materials import Material

SIZE = 256
CELLS = 64
OCTAVES = ((6.0, 0.3), (1.0, 0.45), (0.35, 0.45), (0.12, 0.45), (0.04, 0.4))
"""Grains relative to the material's own, and how much of its contrast each makes."""
LOWEST_GRAIN = 0.003


def tile_of_noise(seed: int) -> NDArray[np.float32]:
    """Smooth noise that repeats, float32 (256, 256), mean 0, 64 cells wide, within about -1..1."""
    coarse = np.random.default_rng(seed).uniform(-1, 1, (CELLS, CELLS)).astype(np.float32)
    wrapped = cv2.copyMakeBorder(coarse, 2, 2, 2, 2, cv2.BORDER_WRAP)
    scale = SIZE // CELLS
    fine = cv2.resize(wrapped, None, fx=scale, fy=scale, interpolation=cv2.INTER_CUBIC)
    kept = np.ascontiguousarray(fine[2 * scale : -2 * scale, 2 * scale : -2 * scale])
    centred: NDArray[np.float32] = (kept - kept.mean()).astype(np.float32)
    return centred


class Texture:
    """How far the albedo of a point lies above or below its material's colour."""

    def __init__(self, materials: Sequence[Material]) -> None:
        """Take grain and contrast of the materials that indices mean."""
        grains = np.array([material.grain for material in materials], np.float32)
        self._cells_per_m = np.reciprocal(np.maximum(grains, np.float32(LOWEST_GRAIN)))
        self._contrast = np.array([material.contrast for material in materials], np.float32)
        self._tile = tile_of_noise(0)

    def factor(
        self,
        points: NDArray[np.float32],
        normals: NDArray[np.float32],
        material: NDArray[np.uint8],
        footprint: NDArray[np.float32],
    ) -> NDArray[np.float32]:
        """Factors of the albedo, float32 (N,), mean about 1.

        The noise lies in the two axes that the surface faces least. A grain fades as it comes
        near the footprint of a pixel, so that none is finer than the picture can show.

        Args:
            points: float32 (N, 3), metres, world frame.
            normals: float32 (N, 3), unit.
            material: uint8 (N,), indices into the materials.
            footprint: float32 (N,), width of a pixel on the surface, metres.
        """
        across, along = _plane(points, normals)
        cells = self._cells_per_m[material]
        u, v, width = across * cells, along * cells, footprint * cells
        total = np.zeros(len(points), np.float32)
        for grain, amplitude in OCTAVES:
            seen = np.clip(2 - width * np.float32(2.0 / grain), 0, 1)
            noise = self._look_up(u / np.float32(grain), v / np.float32(grain))
            total += np.asarray(seen * np.float32(amplitude) * noise, np.float32)
        return np.asarray(np.maximum(1 + self._contrast[material] * total, 0.05), np.float32)

    def _look_up(
        self, across: NDArray[np.float32], along: NDArray[np.float32]
    ) -> NDArray[np.float32]:
        u, v = (_into_tile(axis).reshape(1, -1) for axis in (across, along))
        return _sample(self._tile, u, v)


def _into_tile(cells: NDArray[np.float32]) -> NDArray[np.float32]:
    turns = cells * np.float32(1.0 / CELLS)
    turns -= np.floor(turns)
    turns *= np.float32(SIZE)
    return turns


def _sample(
    tile: NDArray[np.float32], u: NDArray[np.float32], v: NDArray[np.float32]
) -> NDArray[np.float32]:
    """Bilinear look-up; OpenCV takes rows of less than 2^15 only."""
    found = [
        cv2.remap(
            tile,
            u[:, at : at + 32_000],
            v[:, at : at + 32_000],
            cv2.INTER_LINEAR,
            borderMode=cv2.BORDER_WRAP,
        )
        for at in range(0, u.shape[1], 32_000)
    ]
    joined: NDArray[np.float32] = np.concatenate([np.empty((1, 0), np.float32), *found], axis=1)[0]
    return joined


def _plane(
    points: NDArray[np.float32], normals: NDArray[np.float32]
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    x, y, z = points.T
    nx, ny, nz = np.abs(normals.T)
    level = (nz >= nx) & (nz >= ny)
    across = np.where(level | (ny > nx), x, y)
    return across, np.where(level, y, z)
