"""A map of what stands around the robot."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from graspe_data.manifest import Settings


class OccupancyMapSettings(Settings):
    """The map's size and what fills a cell; metres, heights above the ground."""

    size: Annotated[int, Field(ge=1, le=4096)] = 200
    """Cells along each side; the groups use 200."""
    resolution: Annotated[float, Field(gt=0, le=10)] = 0.05
    """Side of a cell; the groups use 0.05."""
    minimum_height: float = 0.15
    maximum_height: float = 1.2
    minimum_points: Annotated[int, Field(ge=1)] = 2
    """Returns that fill a cell; a single one may be noise."""

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        low, high = self.minimum_height, self.maximum_height
        if low > high:
            raise ValueError(f"minimum_height {low} is above maximum_height {high}")
        return self


@dataclass(frozen=True)
class OccupancyMap:
    """Cells around base_link, which is the corner in the middle.

    ``occupied``: bool (S, S), the first axis along x and the second along y, both upward.
    ``resolution``: side of a cell, metres.
    """

    occupied: NDArray[np.bool_]
    resolution: float

    def points(self) -> NDArray[np.float64]:
        """Centres of the occupied cells, float64 (N, 2), metres, base_link."""
        middle = np.array(self.occupied.shape) / 2
        return (np.argwhere(self.occupied) + 0.5 - middle) * self.resolution


def occupancy_map(
    xyz: NDArray[np.floating], base_height: float, settings: OccupancyMapSettings
) -> OccupancyMap:
    """Fill the cells that hold returns within a band of height.

    Args:
        xyz: Points (N, 3), metres, base_link.
        base_height: Height of base_link above the ground, metres.
        settings: Size and band.
    """
    low, high = settings.minimum_height - base_height, settings.maximum_height - base_height
    standing = xyz[(xyz[:, 2] >= low) & (xyz[:, 2] <= high), :2]
    cells = np.floor(standing / settings.resolution + settings.size / 2)
    inside = np.all((cells >= 0) & (cells < settings.size), axis=1)
    row, column = cells[inside].astype(np.int64).T
    shape = (settings.size, settings.size)
    counts = np.bincount(row * settings.size + column, minlength=settings.size**2).reshape(shape)
    return OccupancyMap(counts >= settings.minimum_points, settings.resolution)
