"""A planar laser scan cut out of a cloud."""

from __future__ import annotations

from typing import Annotated, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from graspe_data.manifest import Settings


class LaserScanSettings(Settings):
    """Rays over half a circle and the band that counts: metres above the ground, metres, rad."""

    rays: Annotated[int, Field(gt=0, le=65536)] = 720
    half_angle: Annotated[float, Field(gt=0, le=np.pi)] = np.pi / 2
    minimum_height: Annotated[float, Field(ge=-1000, le=1000)] = 0.15
    maximum_height: Annotated[float, Field(ge=-1000, le=1000)] = 1.2
    minimum_range: Annotated[float, Field(ge=0, le=10_000)] = 0.3
    maximum_range: Annotated[float, Field(gt=0, le=10_000)] = 10.0

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        for what in ("height", "range"):
            low, high = getattr(self, f"minimum_{what}"), getattr(self, f"maximum_{what}")
            if low > high:
                raise ValueError(f"minimum_{what} {low} is above maximum_{what} {high}")
        return self


def laser_scan(
    xyz: NDArray[np.float32], base_height: float, settings: LaserScanSettings
) -> NDArray[np.float32]:
    """Find the nearest point in each ray's sector, as pointcloud_to_laserscan does.

    A point counts when its height above the ground and its horizontal range are within the limits,
    both inclusive, and its azimuth in the half-open interval [-half_angle, half_angle).

    Args:
        xyz: Points (N, 3), metres, base_link.
        base_height: Height of base_link above the ground, metres.
        settings: The band and the rays.

    Returns:
        float32 (rays,): minimum horizontal range in metres from right to left, inf where empty.
    """
    x, y, z = xyz.T
    squared = x * x + y * y
    # Points at the heights of obstacles, within range.
    low, high = settings.minimum_height - base_height, settings.maximum_height - base_height
    near, far = settings.minimum_range**2, settings.maximum_range**2
    rows = np.flatnonzero((z >= low) & (z <= high) & (squared >= near) & (squared <= far))
    # The ray that each falls in, from right to left; the nearest point of a ray counts.
    angle = np.arctan2(y[rows], x[rows], dtype=np.float64) + settings.half_angle
    ray = np.floor(angle * (settings.rays / (2 * settings.half_angle))).astype(np.int64)
    inside = (ray >= 0) & (ray < settings.rays)
    scan = np.full(settings.rays, np.inf, np.float32)
    np.minimum.at(scan, ray[inside], np.sqrt(squared[rows[inside]]))
    return scan
