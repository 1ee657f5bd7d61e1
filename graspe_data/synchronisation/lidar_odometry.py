"""Odometry out of clouds alone, by KISS-ICP (Vizzo et al., 2023, RA-L 8(2)).

Each cloud is registered against a map of the surroundings with point-to-point ICP. The poses drift,
as those of every odometry do, and carry noise of centimetres: ``fitted_velocities`` makes
velocities of them.

Same clouds, same bytes: KISS-ICP sums in parallel, and a sum's last digits depend on how it was
split, so it runs on one thread here; its maps are keyed by whole numbers, so that their order does
not depend on addresses. Another processor may choose other kernels, and with them other last
digits.

What it cannot do: clouds hold no times of their points, so the sweep is taken as one instant. While
the robot turns, a rotating lidar's poses lag or lead by up to half a sweep. In a corridor without
features the motion along it cannot be seen, and comes out too small.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from graspe_data.errors import RecordingError
from graspe_data.geometry import Transform, quaternion_from_rotation
from graspe_data.sensor_data import PointCloud

Floats = NDArray[np.float64]

FEWEST_POINTS = 30
"""Points, one a coarse voxel, below which a cloud says too little of six degrees of freedom."""
SHARE_MATCHED = 0.5
"""Share of a cloud's points that must lie beside points of the cloud before."""
LOST_AFTER = 5
"""Clouds in a row that match nothing, after which the map is begun anew."""
LONGEST_GUESS_S = 1.0
"""How long a robot is taken to go on as it did, where clouds are missing."""
VOXELS_ACROSS = 60
"""Voxels between the lidar and what is far in the first cloud (the 90th percentile)."""
SMALLEST_VOXEL_M = 0.1


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
        return cls(cv2.Rodrigues(step.rotation)[0][:, 0] / seconds, step.translation / seconds)

    def after(self, seconds: float) -> Transform:
        span = min(seconds, LONGEST_GUESS_S)
        return Transform(cv2.Rodrigues(self.rotation * span)[0], self.translation * span)


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
        self._library = _Library.load()
        self._matcher: _Matcher | None = None
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
        points = self._within_range(cloud.xyz)
        if len(points) < FEWEST_POINTS:
            return None
        if self._matcher is None:
            return self._begin(points, cloud.stamp_ns)
        seconds = (cloud.stamp_ns - self._last_ns) * 1e-9
        found = self._matcher.match(points, self._pose @ self._speed.after(seconds))
        if found is None:
            return self._unusable(points, cloud.stamp_ns)
        if seconds > 0:
            self._speed = _Speed.between(self._pose, found, seconds)
        self._pose, self._last_ns, self._unmatched = found, cloud.stamp_ns, 0
        return found

    def _begin(self, points: Floats, stamp_ns: int) -> Transform | None:
        matcher = _Matcher(self._library, _voxel_size(points), self._ranges[1])
        if not matcher.begin(points, self._pose):
            return None
        self._matcher, self._speed = matcher, _Speed.none()
        self._last_ns, self._unmatched = stamp_ns, 0
        return self._pose

    def _unusable(self, points: Floats, stamp_ns: int) -> Transform | None:
        self._unmatched += 1
        return self._begin(points, stamp_ns) if self._unmatched > LOST_AFTER else None

    def _within_range(self, xyz: NDArray[np.float32]) -> Floats:
        points = xyz.astype(np.float64)
        distance = np.sqrt(np.einsum("ij,ij->i", points, points))
        low, high = self._ranges
        return np.ascontiguousarray(points[(distance > low) & (distance < high)])


class _Matcher:
    """A local map and the registration of clouds against it."""

    def __init__(self, library: _Library, voxel_size: float, maximum_range: float) -> None:
        self._voxel_size = voxel_size
        self._thin = library.thin
        self._registration, self._map, self._threshold = library.parts(voxel_size, maximum_range)
        self._before: Floats = np.empty((0, 3))

    def begin(self, points: Floats, pose: Transform) -> bool:
        fine, coarse = self._thinned(points)
        usable = len(coarse) >= FEWEST_POINTS
        if usable:
            self._keep(fine, pose)
        return usable

    def match(self, points: Floats, guess: Transform) -> Transform | None:
        """The pose of a cloud, or None where it does not lie on the cloud before."""
        fine, coarse = self._thinned(points)
        if len(coarse) < FEWEST_POINTS:
            return None
        sigma = self._threshold.get_threshold()
        start = _matrix(guess)
        found = self._registration.align_points_to_map(coarse, self._map, start, 3 * sigma, sigma)
        pose = Transform(found[:3, :3], found[:3, 3])
        if not np.isfinite(found).all() or self._share_matched(pose.apply(coarse)) < SHARE_MATCHED:
            return None
        self._threshold.update_model_deviation(_matrix(guess.inverse() @ pose))
        self._keep(fine, pose)
        return pose

    def _thinned(self, points: Floats) -> tuple[Floats, Floats]:
        fine = self._thin(points, 0.5 * self._voxel_size)
        return fine, self._thin(fine, 1.5 * self._voxel_size)

    def _keep(self, points: Floats, pose: Transform) -> None:
        self._map.update(points, _matrix(pose))
        self._before = np.asarray(pose.apply(points), np.float64)

    def _share_matched(self, points: NDArray[np.floating]) -> float:
        """Share of points with a point of the cloud before in their voxel or beside it."""
        around = np.stack(np.meshgrid(*[[-1, 0, 1]] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
        cells = np.floor(points / self._voxel_size).astype(np.int64)
        taken = np.unique(_cell_keys(np.floor(self._before / self._voxel_size).astype(np.int64)))
        near = np.isin(_cell_keys(cells[:, None, :] + around), taken)
        return float(near.any(axis=1).mean())


@dataclass(frozen=True)
class _Library:
    """The parts of KISS-ICP, which is an extra."""

    config: Any
    registration: Any
    mapping: Any
    threshold: Any
    thin: Any

    @classmethod
    def load(cls) -> _Library:
        try:
            from kiss_icp import config, mapping, registration, threshold, voxelization  # noqa: PLC0415
        except ModuleNotFoundError as error:
            if error.name is None or error.name.partition(".")[0] != "kiss_icp":
                raise
            raise RecordingError(
                "Odometry from the lidar (`odometry: lidar`) is made by KISS-ICP, which is not "
                "installed: pip install 'graspe[lidar_odometry]'."
            ) from error
        return cls(config.config, registration, mapping, threshold, voxelization.voxel_down_sample)

    def parts(self, voxel_size: float, maximum_range: float) -> tuple[Any, Any, Any]:
        """Registration, map and threshold; numbers are given here, none by the environment."""
        registration = self.registration.Registration(
            max_num_iterations=500, convergence_criterion=1e-4, max_num_threads=1
        )
        local_map = self.mapping.VoxelHashMap(voxel_size, maximum_range, max_points_per_voxel=20)
        settings = _ThresholdSettings(
            self.config.DataConfig(max_range=maximum_range),
            self.config.AdaptiveThresholdConfig(initial_threshold=2 * voxel_size),
        )
        return registration, local_map, self.threshold.AdaptiveThreshold(settings)


@dataclass(frozen=True)
class _ThresholdSettings:
    data: Any
    adaptive_threshold: Any


def _voxel_size(points: Floats) -> float:
    far = float(np.quantile(np.linalg.norm(points, axis=1), 0.9))
    return max(far / VOXELS_ACROSS, SMALLEST_VOXEL_M)


def _cell_keys(cells: NDArray[np.int64]) -> NDArray[np.int64]:
    """One number a cell (..., 3), wrapped at 2^21 cells a side."""
    x, y, z = np.moveaxis(cells & 0x1FFFFF, -1, 0)
    keys: NDArray[np.int64] = (x << 42) | (y << 21) | z
    return keys


def _matrix(pose: Transform) -> Floats:
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = pose.rotation, pose.translation
    return matrix


def fitted_velocities(stamps_ns: NDArray[np.int64], position: Floats, quaternion: Floats) -> Floats:
    """To come."""
    raise NotImplementedError
