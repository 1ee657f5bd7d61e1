"""Odometry out of clouds alone, by KISS-ICP (Vizzo et al., 2023, RA-L 8(2)).

Each cloud's upright points are registered against a map of the surroundings with point-to-point
ICP. The poses drift, as those of every odometry do, by one or two hundredths of the way, and carry
noise of centimetres: ``fitted_velocities`` makes velocities of them. In worlds of known shape these
are right to .05 m/s and .003 rad/s; they are worst in the first half second, before a speed is
known to begin the search from.

Same clouds, same bytes, whatever the threads (see ``kiss_icp_parts``); poses are rounded far below
their noise, so that another processor's last digits do not add up.

What it cannot do: clouds hold no times of their points, so the sweep is taken as one instant
(deskewing is off). A turn of 1 rad/s then shifts the heading by up to half a sweep of it. In a
corridor without features, or on a bare plain, motion cannot be seen and comes out far too small.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from graspe_data.arrays import Floats
from graspe_data.errors import RecordingError
from graspe_data.geometry import Transform, quaternion_from_rotation
from graspe_data.sensor_data import PointCloud
from graspe_data.synchronisation.kiss_icp_parts import KissIcp
from graspe_data.synchronisation.local_map import FEWEST_POINTS, LocalMap, moved, upright

LOST_AFTER = 5
"""Clouds in a row that match nothing, after which the map is begun anew."""
LONGEST_GUESS_S = 1.0
"""How long a robot is taken to go on as it did, where clouds are missing."""
VOXELS_ACROSS = 60
"""Voxels between the lidar and what is far in the first cloud (the 90th percentile)."""
VOXEL_M = (0.5, 1.0)
"""The smallest and the largest voxel."""
FEWEST_UPRIGHT = 300
"""Upright points below which the ground must help, as in an open field."""


@dataclass(frozen=True)
class _Speed:
    """Motion in the lidar's frame: a rotation vector rad/s and a translation m/s."""

    rotation: Floats
    translation: Floats

    @classmethod
    def none(cls) -> _Speed:
        return cls(np.zeros(3), np.zeros(3))

    @classmethod
    def between(cls, before: Transform, after: Transform, seconds: float) -> _Speed:
        step = before.inverse() @ after
        turn = np.asarray(cv2.Rodrigues(step.rotation)[0][:, 0], np.float64)
        return cls(turn / seconds, step.translation / seconds)

    def after(self, seconds: float) -> Transform:
        span = min(seconds, LONGEST_GUESS_S)
        turn = np.asarray(cv2.Rodrigues(self.rotation * span)[0], np.float64)
        return Transform(turn, self.translation * span)


class LidarOdometry:
    """Poses of the base from its lidar's clouds, fed in the order of time.

    The fixed frame is the base's at the first usable cloud. A cloud is not usable, and its pose is
    NaN, where too few of its points lie within range or too few lie beside those of the cloud
    before; the next one is registered again. After ``LOST_AFTER`` such clouds in a row that match
    nothing, a new map begins at the last pose known, so that a jump may hide in the gap.

    Memory: the surroundings within ``maximum_range`` of the last cloud, and eight numbers a cloud.
    """

    def __init__(
        self, base_from_lidar: Transform, maximum_range: float = 100.0, minimum_range: float = 0.0
    ) -> None:
        """Take the lidar's mounting in the base and the ranges in metres that count.

        Raises:
            RecordingError: KISS-ICP is not installed.
        """
        self._mounting = base_from_lidar
        self._ranges = (minimum_range, maximum_range)
        self._library = KissIcp.load()
        self._map: LocalMap | None = None
        self._pose, self._speed = Transform.identity(), _Speed.none()
        self._last_ns = 0
        self._unmatched = 0
        self._stamps: list[int] = []
        self._poses: list[Floats] = []

    def add(self, cloud: PointCloud) -> None:
        """Register the next cloud.

        Raises:
            RecordingError: The cloud is older than the one before.
        """
        if self._stamps and cloud.stamp_ns < self._stamps[-1]:
            raise RecordingError(
                f"Lidar odometry: a cloud at {cloud.stamp_ns} ns comes after one at "
                f"{self._stamps[-1]} ns. Feed one stretch at a time, in the order of stamps."
            )
        self._stamps.append(cloud.stamp_ns)
        self._poses.append(self._base_pose(self._register(cloud)))

    def result(self) -> tuple[NDArray[np.int64], Floats, Floats]:
        """Stamps int64 (N,) ns, positions (N, 3) m, quaternions (N, 4) x, y, z, w; NaN: no pose."""
        poses = np.array(self._poses, np.float64).reshape(-1, 7)
        return np.array(self._stamps, np.int64), poses[:, :3].copy(), poses[:, 3:].copy()

    def _base_pose(self, lidar: Transform | None) -> Floats:
        if lidar is None:
            return np.full(7, np.nan)
        base = self._mounting @ lidar @ self._mounting.inverse()
        return np.concatenate([base.translation, quaternion_from_rotation(base.rotation[None])[0]])

    def _register(self, cloud: PointCloud) -> Transform | None:
        points = self._points_that_tell(cloud.xyz)
        if len(points) < FEWEST_POINTS:
            return None
        if self._map is None:
            return self._begin(points, cloud.stamp_ns)
        seconds = (cloud.stamp_ns - self._last_ns) * 1e-9
        found = self._map.match(points, self._pose @ self._speed.after(seconds))
        if found is None:
            return self._unusable(points, cloud.stamp_ns)
        if seconds > 0:
            self._speed = _Speed.between(self._pose, found, seconds)
        self._pose, self._last_ns, self._unmatched = found, cloud.stamp_ns, 0
        return found

    def _begin(self, points: Floats, stamp_ns: int) -> Transform | None:
        local_map = LocalMap(self._library, _voxel_size(points), self._ranges[1])
        if not local_map.begin(points, self._pose):
            return None
        self._map, self._speed = local_map, _Speed.none()
        self._last_ns, self._unmatched = stamp_ns, 0
        return self._pose

    def _unusable(self, points: Floats, stamp_ns: int) -> Transform | None:
        self._unmatched += 1
        return self._begin(points, stamp_ns) if self._unmatched > LOST_AFTER else None

    def _points_that_tell(self, xyz: NDArray[np.float32]) -> Floats:
        """Points within range, of these the upright ones where there are enough."""
        points = xyz.astype(np.float64, order="C")
        distance = np.sqrt(points[:, 0] ** 2 + points[:, 1] ** 2 + points[:, 2] ** 2)
        low, high = self._ranges
        points = points[(distance > low) & (distance < high)]
        tells = upright(moved(points, self._mounting))
        return np.ascontiguousarray(points[tells] if tells.sum() >= FEWEST_UPRIGHT else points)


def _voxel_size(points: Floats) -> float:
    far = float(np.quantile(np.linalg.norm(points, axis=1), 0.9))
    return float(np.clip(far / VOXELS_ACROSS, *VOXEL_M))
