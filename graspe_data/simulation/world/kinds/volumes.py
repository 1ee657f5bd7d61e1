"""Random points in volumes that leaves fill."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from graspe_data.arrays import Floats


def leaf_counts(density: Floats, volume: Floats, area: float) -> NDArray[np.int64]:
    """How many leaves of an area in m2 give a density in m2 per m3 of volumes in m3 (Ross 1981)."""
    counts: NDArray[np.int64] = np.rint(density * volume / area).astype(np.int64)
    return counts


def in_balls(counts: NDArray[np.int64], generator: np.random.Generator) -> NDArray[np.float32]:
    """Points (sum of counts, 3), uniformly in the unit ball."""
    total = int(counts.sum())
    points = generator.standard_normal((total, 3), dtype=np.float32)
    points /= np.maximum(np.linalg.norm(points, axis=1, keepdims=True), np.float32(1e-12))
    points *= np.cbrt(generator.random((total, 1), dtype=np.float32))
    return points


def in_discs(counts: NDArray[np.int64], generator: np.random.Generator) -> NDArray[np.float32]:
    """Points (sum of counts, 2), uniformly in the unit disc."""
    total = int(counts.sum())
    angle = 2 * np.pi * generator.random(total, dtype=np.float32)
    reach = np.sqrt(generator.random(total, dtype=np.float32))
    return np.stack([reach * np.cos(angle), reach * np.sin(angle)], axis=1)
