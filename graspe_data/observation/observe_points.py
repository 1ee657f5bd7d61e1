"""From a decoded cloud to the points of one row."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Annotated, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from graspe_data.geometry import Transform
from graspe_data.manifest import Settings
from graspe_data.observation.laser_scan import LaserScanSettings, laser_scan
from graspe_data.observation.move_points import move_points
from graspe_data.observation.point_sample import PointSampleSettings, front, sample_points
from graspe_data.observation.ring_order import ring_order
from graspe_data.observation.smoothness import smoothness
from graspe_data.sensor_data import PointCloud


class PointObservationSettings(Settings):
    """How a cloud is observed; all from ``rings`` on describe the robot, lengths in metres.

    Returns nearer than ``minimum_range`` hit the robot, and coordinates beyond ``maximum_range``
    are damage; neither counts.
    """

    neighbours: Annotated[int, Field(gt=0, le=1000)] = 5
    sample: PointSampleSettings = PointSampleSettings()
    laser_scan: LaserScanSettings = LaserScanSettings()
    rings: Annotated[int, Field(ge=1, le=256)] | None = None
    intensity_maximum: Annotated[float, Field(gt=0)] = 255.0
    minimum_range: Annotated[float, Field(ge=0)] = 0.0
    maximum_range: Annotated[float, Field(gt=0, le=1e6)] = 1000.0
    base_height: float = 0.0

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        near, far = self.minimum_range, self.maximum_range
        if near > far:
            raise ValueError(f"minimum_range {near} is above maximum_range {far}")
        return self


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
    useful = _within_range(cloud, settings)
    moved = move_points(useful.xyz, base_from_lidar)
    ahead = np.flatnonzero(front(moved, settings.sample.half_angle))
    view, in_front = _taken(useful, ahead), _points_taken(moved, ahead)
    wider = settings.laser_scan.half_angle > settings.sample.half_angle
    scan = laser_scan(moved if wider else in_front, settings.base_height, settings.laser_scan)
    turned = _turned_ahead(view.xyz, base_from_lidar)
    found = ring_order(turned, view.ring, settings.rings, view.intensity)
    ordered = _points_taken(view.xyz, found.order)
    curvature = smoothness(ordered, found.ring_starts, settings.neighbours)
    strength = None
    if view.intensity is not None:
        measured = view.intensity.take(found.order)
        strength = np.clip(measured / np.float32(settings.intensity_maximum), 0, 1)
    points = _points_taken(in_front, found.order)
    sample = sample_points(points, strength, curvature, settings.sample.count, seed)
    return PointObservation(
        sample.points, sample.intensity, sample.smoothness, sample.point_count, scan
    )


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
