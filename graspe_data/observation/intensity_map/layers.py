"""The multi-layer intensity map: equations (1) and (2) of the paper."""

from __future__ import annotations

import math
from typing import Annotated, Literal, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from graspe_data.errors import ObservationError
from graspe_data.geometry import Transform, move_points
from graspe_data.manifest import Settings
from graspe_data.observation.intensity_map.grid import GridSettings, cells_of
from graspe_data.observation.intensity_map.strength import IntensityScale
from graspe_data.robot import Robot
from graspe_data.sensor_data import PointCloud

Interval = tuple[float, float]

BLOCK = 16_384
"""Points placed at once: what is made of them on the way stays in the processor's cache."""


class LayerSettings(Settings):
    """The grid, the height intervals of the layers, and what a cell holds."""

    grid: GridSettings = GridSettings()
    intervals: Annotated[tuple[Interval, ...], Field(min_length=1, max_length=8)] = (
        (-0.6, -0.1),
        (-0.1, 0.1),
        (0.1, 0.6),
    )
    """Metres, each [from, to), from low to high and disjoint."""
    heights: Literal["lidar", "ground"] = "lidar"
    """What they are measured from."""
    cell: Literal["sum", "max", "mean"] = "sum"
    """Of the intensities in a cell; a sum counts no higher than the sensor's maximum."""

    @property
    def shape(self) -> tuple[int, int, int]:
        """Layers, rows and columns."""
        return len(self.intervals), self.grid.cells, self.grid.cells

    @model_validator(mode="after")
    def _disjoint(self) -> Self:
        for low, high in self.intervals:
            if low >= high:
                raise ValueError(f"intervals: [{low}, {high}) is empty")
        for (_, below), (above, _) in zip(self.intervals, self.intervals[1:], strict=False):
            if above < below:
                raise ValueError(f"intervals: one begins at {above}, before the last ends, {below}")
        return self


class ReturnSettings(Settings):
    """What the robot decides: its lidar's scale, its own body, the height of base_link; metres."""

    intensity_maximum: Annotated[float, Field(gt=0)] = 255.0
    minimum_range: Annotated[float, Field(ge=0)] = 0.0
    """Returns nearer to the lidar hit the robot itself."""
    maximum_range: Annotated[float, Field(gt=0, le=1e6)] = 1000.0
    """Coordinates beyond are damage."""
    base_height: float = 0.0

    @classmethod
    def of(cls, robot: Robot) -> Self:
        """Those of a robot manifest."""
        return cls(
            intensity_maximum=robot.lidar.intensity_maximum,
            minimum_range=robot.lidar.minimum_range,
            base_height=robot.base_height,
        )


def intensity_layers(
    cloud: PointCloud,
    base_from_lidar: Transform,
    returns: ReturnSettings,
    settings: LayerSettings,
    scale: IntensityScale | None = None,
) -> NDArray[np.float32]:
    """Gather the intensities of a cloud in the cells of each height interval.

    Equation (1): I(r, c) = sum of int_k over the points k in cell (r, c) and height interval, as a
    share of the sensor's maximum and no more than 1; or their greatest, or their mean. Equation
    (2): the intervals stacked. The result does not depend on the order of the points.

    Args:
        cloud: In the lidar's frame, with intensity.
        base_from_lidar: Carries points of the lidar into base_link.
        returns: See ``ReturnSettings``.
        settings: See ``LayerSettings``.
        scale: Of the lidar, which has seen its earlier clouds; None lets this cloud alone tell.

    Returns:
        float32 (layers, cells, cells), 0..1; row 0 ahead of the robot, column 0 to its left.

    Raises:
        ObservationError: No intensity, none that is valid, or not on the declared scale, or on
            one that cannot be told.
    """
    xyz, intensity = _within_range(cloud, returns)
    scale = scale or IntensityScale(returns.intensity_maximum)
    strength = scale.strength(intensity)
    zero = float(base_from_lidar.translation[2])
    if settings.heights == "ground":
        zero = -returns.base_height
    blocks = range(0, len(xyz), BLOCK)
    places = [
        _places(move_points(xyz[b : b + BLOCK], base_from_lidar), zero, settings) for b in blocks
    ]
    kept = np.concatenate([place >= 0 for place in places])
    place, shape = np.concatenate([place[place >= 0] for place in places]), settings.shape
    gathered = _gather(place, strength[kept], math.prod(shape), settings.cell)
    # Only cells with returns are written: the time does not grow with the layers.
    shares = np.zeros(math.prod(shape), np.float32)
    shares[place] = np.minimum(gathered[place] / returns.intensity_maximum, 1.0)
    return shares.reshape(shape)


def _within_range(
    cloud: PointCloud, returns: ReturnSettings
) -> tuple[NDArray[np.float32], NDArray[np.float32] | None]:
    given = cloud.intensity
    if given is not None and given.shape != (len(cloud.xyz),):
        raise ObservationError(
            f"The cloud has {len(cloud.xyz)} returns and intensities {given.shape}; expected one "
            f"each: the decoder or the driver drops some."
        )
    x, y, z = cloud.xyz.T
    with np.errstate(over="ignore"):
        squared = x * x + y * y + z * z
    # What lies at the origin is no return, however near the robot's body may be.
    counts = (squared >= np.float32(returns.minimum_range**2)) & (squared > 0)
    counts &= squared <= np.float32(returns.maximum_range**2)
    if counts.all():
        return cloud.xyz, given
    rows = np.flatnonzero(counts)
    return cloud.xyz.take(rows, axis=0), None if given is None else given[rows]


def _places(xyz: NDArray[np.float32], zero: float, settings: LayerSettings) -> NDArray[np.int64]:
    """The index of each point's cell among those of all layers, (N,); -1 for points in none."""
    x, y, z = xyz.T
    bounds = np.asarray(settings.intervals, np.float32).ravel()
    # The bounds ascend, from, to, from, to: past an odd number of them a height is in an interval.
    passed = np.searchsorted(bounds, z - np.float32(zero), side="right")
    row, column, inside = cells_of(x, y, settings.grid)
    rows = np.flatnonzero(inside & (passed % 2 == 1))
    side, place = settings.grid.cells, np.full(len(xyz), -1, np.int64)
    layer = passed[rows] // 2
    place[rows] = (layer * side + row[rows].astype(np.int64)) * side + column[rows].astype(np.int64)
    return place


def _gather(
    place: NDArray[np.int64], strength: NDArray[np.float32], size: int, how: str
) -> NDArray[np.float64]:
    """One value a place, float64 (size,), on the sensor's own scale."""
    if how == "max":
        greatest = np.zeros(size)
        np.maximum.at(greatest, place, strength.astype(np.float64))
        return greatest
    # Float32 weights summed in float64 are exact, whatever their order.
    total = np.asarray(np.bincount(place, strength, size), np.float64)
    if how == "mean":
        total[place] = total[place] / np.bincount(place, minlength=size)[place]
    return total
