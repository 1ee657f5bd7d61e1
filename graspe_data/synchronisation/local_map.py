"""The upright surroundings as a map, and a cloud registered against it, by KISS-ICP."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from graspe_data.arrays import Floats
from graspe_data.geometry import Transform, quaternion_from_rotation
from graspe_data.synchronisation.kiss_icp_parts import KissIcp

CELL_M = (1.0, 1.0, 2.0)
UPRIGHT_M = 0.25
"""Rise within a cell, from its lowest to its highest point, above which it is upright."""


def upright(points: Floats) -> NDArray[np.bool_]:
    """Which of the points (N, 3), metres, z up, share a cell with others well above or below.

    These lie on walls, trunks, poles, cars. A lidar draws rings on the ground that move along with
    it. Point-to-point ICP pairs each with the ring of the cloud before, and takes the robot for
    standing still: in a wood with 16 rings the velocity came out 0.25 m/s too small. What is
    upright pulls sideways only where it should.
    """
    if not len(points):
        return np.zeros(0, np.bool_)
    keys = cell_keys(np.floor(points / CELL_M).astype(np.int64))
    _, cell, count = np.unique(keys, return_inverse=True, return_counts=True)
    order = np.argsort(cell, kind="stable")
    starts = np.concatenate([[0], np.cumsum(count)[:-1]])
    height = points[order, 2]
    rise = np.maximum.reduceat(height, starts) - np.minimum.reduceat(height, starts)
    return np.asarray((rise > UPRIGHT_M)[cell])


def moved(points: Floats, by: Transform) -> Floats:
    """Points (N, 3) carried over number by number, so that no library's blocks round otherwise."""
    x, y, z = points.T
    parts = [
        row[0] * x + row[1] * y + row[2] * z + shift
        for row, shift in zip(by.rotation, by.translation, strict=True)
    ]
    return np.stack(parts, axis=1)


def cell_keys(cells: NDArray[np.int64]) -> NDArray[np.int64]:
    """One number a cell (..., 3), wrapped at 2^21 cells a side."""
    x, y, z = np.moveaxis(cells & 0x1FFFFF, -1, 0)
    keys: NDArray[np.int64] = (x << 42) | (y << 21) | z
    return keys


DECIMALS = 7
"""Of a pose: a tenth of a micrometre, and of a microradian."""
FEWEST_POINTS = 30
"""Points, one a voxel, below which a cloud says too little of six degrees of freedom."""
MATCHED_EVERY = 1.0
"""Voxels to a point that is matched. At .5 a cloud takes four times as long and errs as much; at
1.5, as in the paper, velocities in a room err by a third more."""
SHARE_MATCHED = 0.5
"""Share of a cloud's points that must lie beside points of the cloud before."""


class LocalMap:
    """A map of what lies within ``maximum_range`` of the last cloud, metres."""

    def __init__(self, library: KissIcp, voxel_size: float, maximum_range: float) -> None:
        """Take the library and the map's voxel size and range in metres."""
        self._voxel_size = voxel_size
        self._thin = library.thin
        self._registration, self._map, self._threshold = library.parts(voxel_size, maximum_range)
        self._before: Floats = np.empty((0, 3))

    def begin(self, points: Floats, pose: Transform) -> bool:
        """Begin the map with a cloud (N, 3); False where it holds too few points."""
        thinned = self._thin(points, 0.5 * self._voxel_size)
        usable = len(thinned) >= FEWEST_POINTS
        if usable:
            self._keep(thinned, pose)
        return usable

    def match(self, points: Floats, guess: Transform) -> Transform | None:
        """The pose of a cloud (N, 3), or None where it does not lie on the cloud before."""
        fine = self._thin(points, 0.5 * self._voxel_size)
        coarse = self._thin(fine, MATCHED_EVERY * self._voxel_size)
        if len(coarse) < FEWEST_POINTS:
            return None
        sigma = self._threshold.get_threshold()
        start = _matrix(guess)
        found = self._registration.align_points_to_map(coarse, self._map, start, 3 * sigma, sigma)
        if not np.isfinite(found).all():
            return None
        pose = _rounded(found)
        if self._share_matched(moved(coarse, pose)) < SHARE_MATCHED:
            return None
        self._threshold.update_model_deviation(_matrix(guess.inverse() @ pose))
        self._keep(fine, pose)
        return pose

    def _keep(self, points: Floats, pose: Transform) -> None:
        self._map.update(points, _matrix(pose))
        self._before = moved(points, pose)

    def _share_matched(self, points: Floats) -> float:
        """Share of points with a point of the cloud before in their voxel or beside it."""
        around = np.stack(np.meshgrid(*[[-1, 0, 1]] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
        cells = np.floor(points / self._voxel_size).astype(np.int64)
        occupied = np.unique(cell_keys(np.floor(self._before / self._voxel_size).astype(np.int64)))
        near = np.isin(cell_keys(cells[:, None, :] + around), occupied)
        return float(near.any(axis=1).mean())


def _rounded(found: Floats) -> Transform:
    """The pose (4, 4) to ``DECIMALS``, which swallows what a sum's order does to last digits."""
    quaternion = np.round(quaternion_from_rotation(found[None, :3, :3])[0], DECIMALS)
    return Transform.from_quaternion(np.round(found[:3, 3], DECIMALS), quaternion)


def _matrix(pose: Transform) -> Floats:
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = pose.rotation, pose.translation
    return matrix
