"""One observation, composed: from what the sensors gave to the columns of a row.

The one place where GrASPE's equations (1) to (5) follow one another, for the training set, for the
rows that augmentation degrades, and for the robot. Pure: no files, no state.

    picture -> rectified -> (1) brightness, (2) corners, r_img
    cloud   -> base_link -> laser scan,
            -> front half -> rings -> (3) smoothness -> sample -> (4) r_edge, r_planar, (5) r_point

The velocity history is ``velocity_history``, the trajectory image ``PredictedTrajectory``.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace

import numpy as np
from numpy.typing import NDArray

from graspe_data.geometry import Transform, move_points
from graspe_data.observation.image_reliability import ImageReliabilitySettings, image_reliability
from graspe_data.observation.laser_scan import laser_scan
from graspe_data.observation.point_reliability import PointReliabilitySettings, point_reliability
from graspe_data.observation.point_sample import front, sample_points
from graspe_data.observation.ring_order import ring_order
from graspe_data.observation.settings import ObservationSettings, PointObservationSettings
from graspe_data.observation.smoothness import smoothness
from graspe_data.observation.undistortion import Rectifier
from graspe_data.sensor_data import PointCloud


@dataclass(frozen=True)
class PointObservation:
    """The points of a row in base_link, padded with NaN behind ``point_count``.

    ``points``: float32 (count, 3), metres. ``intensity``: float32 (count,), 0..1 of the sensor's
    maximum, NaN where the sensor gives none. ``smoothness``: float32 (count,), equation (3) at
    full resolution. ``laser_scan``: float32 (rays,), metres, from the full cloud.
    """

    points: NDArray[np.float32]
    intensity: NDArray[np.float32]
    smoothness: NDArray[np.float32]
    point_count: int
    laser_scan: NDArray[np.float32]

    def columns(self) -> dict[str, NDArray[np.generic] | float]:
        """The columns of a row that it gives, by name."""
        return dict(vars(self))


@dataclass(frozen=True)
class Observation:
    """What one picture and one cloud come to.

    ``image``: uint8 (H, W, 3), RGB, undistorted, of the dataset's size. ``points``: see
    ``PointObservation``. ``reliabilities``: r_bright, r_corners, r_img, r_edge, r_planar, r_point,
    each in 0..1, before they are rounded to float32.
    """

    image: NDArray[np.uint8]
    points: PointObservation
    reliabilities: dict[str, float]


def observe(
    rgb: NDArray[np.uint8],
    cloud: PointCloud,
    rectifier: Rectifier,
    base_from_lidar: Transform,
    settings: ObservationSettings,
    seed: int,
) -> Observation:
    """Observe a picture and a cloud.

    Args:
        rgb: uint8 (H, W, 3), as recorded.
        cloud: In the lidar's frame.
        rectifier: Of the camera, to ``settings.picture_size``.
        base_from_lidar: Carries points of the lidar into base_link.
        settings: As the rows of a dataset were made.
        seed: Of the sample of points, see ``row_seed``.

    Raises:
        ObservationError: The picture is not of the calibrated size, or the ring field holds no
            ring numbers.
    """
    # The picture as the model sees it, and equations (1) and (2) on it.
    image = rectifier.apply(rgb)
    of_picture = rate_picture(image, settings.image_reliability)
    # Equation (3) on the cloud, and equations (4) and (5) on the smoothness of its sample.
    points = observe_points(cloud, base_from_lidar, settings.points, seed)
    rated = points.smoothness, points.points, points.point_count
    of_points = rate_points(*rated, settings.point_reliability)
    return Observation(image, points, of_picture | of_points)


def rate_picture(image: NDArray[np.uint8], settings: ImageReliabilitySettings) -> dict[str, float]:
    """Equations (1) and (2): r_bright, r_corners and r_img of a picture of the dataset's size."""
    return asdict(image_reliability(image, settings))


def rate_points(
    curvature: NDArray[np.float32],
    points: NDArray[np.float32] | None,
    count: int,
    settings: PointReliabilitySettings,
) -> dict[str, float]:
    """Equations (4) and (5): r_edge, r_planar and r_point.

    Args:
        curvature: Smoothness of the points, float32 (N,), padded behind ``count``.
        points: float32 (N, 3), metres, base_link, padded likewise; None where no coverage is asked
            for.
        count: Points that are no padding.
        settings: Thresholds and weights.
    """
    there = None if points is None else points[:count]
    return asdict(point_reliability(curvature[:count], settings, there))


def observe_points(
    cloud: PointCloud, base_from_lidar: Transform, settings: PointObservationSettings, seed: int
) -> PointObservation:
    """Observe a cloud: base_link, laser scan, front half, ring order, smoothness, sample.

    The smoothness is that of the front half at full resolution: GrASPE's P_lidar before it is
    sampled (section IV-B). The result does not depend on the order of the points in the message.

    Args:
        cloud: In the lidar's frame.
        base_from_lidar: Carries points of the lidar into base_link.
        settings: See ``PointObservationSettings``.
        seed: Of the sample, see ``row_seed``.

    Raises:
        ObservationError: The ring field holds no ring numbers.
    """
    # Into base_link, and the half ahead of the robot.
    useful = _within_range(cloud, settings)
    moved = move_points(useful.xyz, base_from_lidar)
    ahead = np.flatnonzero(front(moved, settings.sample.half_angle))
    view, in_front = _taken(useful, ahead), _points_taken(moved, ahead)
    # The laser scan, of the full cloud where it sees further to the sides.
    wider = settings.laser_scan.half_angle > settings.sample.half_angle
    scan = laser_scan(moved if wider else in_front, settings.base_height, settings.laser_scan)
    # Equation (3) along the rings, in the lidar's frame.
    turned = _turned_ahead(view.xyz, base_from_lidar)
    found = ring_order(turned, view.ring, settings.rings, view.intensity)
    ordered = _points_taken(view.xyz, found.order)
    curvature = smoothness(ordered, found.ring_starts, settings.neighbours)
    # The sample, of points in base_link with what was measured of each.
    strength = _strength(view, found.order, settings.intensity_maximum)
    points = _points_taken(in_front, found.order)
    sample = sample_points(points, strength, curvature, settings.sample.count, seed)
    return PointObservation(
        sample.points, sample.intensity, sample.smoothness, sample.point_count, scan
    )


def _strength(
    cloud: PointCloud, order: NDArray[np.int64], maximum: float
) -> NDArray[np.float32] | None:
    """Intensities in an order, 0..1 of the sensor's maximum; None where there are none."""
    if cloud.intensity is None:
        return None
    strength: NDArray[np.float32] = cloud.intensity.take(order) / np.float32(maximum)
    return np.clip(strength, 0, 1)


def _within_range(cloud: PointCloud, settings: PointObservationSettings) -> PointCloud:
    """The cloud without the returns that do not count; its axes lie one behind the other."""
    x, y, z = axes = np.ascontiguousarray(cloud.xyz.T)
    with np.errstate(over="ignore"):
        squared = x * x + y * y + z * z
    inside = squared <= np.float32(settings.maximum_range**2)
    inside &= squared >= np.float32(settings.minimum_range**2)
    by_axis = replace(cloud, xyz=axes.T)
    return by_axis if inside.all() else _taken(by_axis, np.flatnonzero(inside))


def _taken(cloud: PointCloud, rows: NDArray[np.int64]) -> PointCloud:
    return replace(
        cloud,
        xyz=_points_taken(cloud.xyz, rows),
        intensity=None if cloud.intensity is None else cloud.intensity.take(rows),
        ring=None if cloud.ring is None else cloud.ring.take(rows),
    )


def _points_taken(xyz: NDArray[np.float32], rows: NDArray[np.int64]) -> NDArray[np.float32]:
    """Some of the points (N, 3); each axis lies in one piece of memory, as it is read."""
    return xyz.T.take(rows, axis=1).T


def _turned_ahead(xyz: NDArray[np.float32], transform: Transform) -> NDArray[np.float32]:
    """Turn about the lidar's axis until x points ahead of the robot.

    A ring then begins behind the robot, outside the front half, however the lidar is mounted.
    """
    ahead = transform.rotation[0, :2]
    length = float(np.hypot(*ahead))
    if length == 0 or (ahead[0] > 0 and ahead[1] == 0):
        return xyz
    cosine, sine = (ahead / length).astype(np.float32)
    x, y, z = xyz.T
    return np.stack([cosine * x + sine * y, cosine * y - sine * x, z]).T
