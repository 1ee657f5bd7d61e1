"""A fixed number of points drawn from a cloud, the same ones every time."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from graspe_data.manifest import Settings


class PointSampleSettings(Settings):
    """Points a row holds and the sector they come from: azimuth within +-``half_angle``, rad."""

    count: Annotated[int, Field(gt=0)] = 10000
    half_angle: Annotated[float, Field(gt=0, le=np.pi)] = np.pi / 2


@dataclass(frozen=True)
class PointSample:
    """Points drawn without replacement, in canonical order, padded with NaN behind the last.

    ``points``: float32 (count, 3), metres. ``intensity`` and ``smoothness``: float32 (count,).
    ``point_count``: real points.
    """

    points: NDArray[np.float32]
    intensity: NDArray[np.float32]
    smoothness: NDArray[np.float32]
    point_count: int


def row_seed(dataset_seed: int, recording_digest: str, stamp_ns: int) -> int:
    """Seed of one row: the first 8 bytes of a SHA-256 over what names the row."""
    name = f"{dataset_seed}:{recording_digest}:{stamp_ns}"
    return int.from_bytes(hashlib.sha256(name.encode()).digest()[:8], "little")


def front(xyz: NDArray[np.float32], half_angle: float) -> NDArray[np.bool_]:
    """Tell which points (N, 3) in base_link have an azimuth within +-``half_angle``, inclusive."""
    x, y, _ = xyz.T
    cosine = np.float32(round(float(np.cos(half_angle)), 12))
    ahead: NDArray[np.bool_] = x >= (cosine * np.sqrt(x * x + y * y) if cosine else cosine)
    return ahead


def sample_points(
    xyz: NDArray[np.float32],
    intensity: NDArray[np.float32] | None,
    smoothness: NDArray[np.float32],
    count: int,
    seed: int,
) -> PointSample:
    """Draw ``count`` points without replacement, or take all where there are fewer.

    Each point gets a raw 64-bit word of PCG64 and the smallest words are drawn: the raw stream,
    unlike NumPy's ``choice``, never changes between versions.

    Args:
        xyz: Points (N, 3), metres, in canonical order.
        intensity: (N,), or None where the sensor has none: then NaN throughout.
        smoothness: (N,).
        count: Points wanted.
        seed: See ``row_seed``.
    """
    rows = _draw(len(xyz), count, seed)
    points = np.full((count, 3), np.nan, np.float32)
    values = np.full((2, count), np.nan, np.float32)
    for axis, drawn in zip(points.T, xyz.T.take(rows, axis=1), strict=True):
        axis[: len(rows)] = drawn
    values[1, : len(rows)] = smoothness.take(rows)
    if intensity is not None:
        values[0, : len(rows)] = intensity.take(rows)
    return PointSample(points, values[0], values[1], len(rows))


def _draw(total: int, count: int, seed: int) -> NDArray[np.int64]:
    if total <= count:
        return np.arange(total)
    words = np.random.PCG64(seed).random_raw(total)
    return np.flatnonzero(words <= np.partition(words, count - 1)[count - 1])
