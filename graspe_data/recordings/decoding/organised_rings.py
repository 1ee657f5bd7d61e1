"""The rings of an organised cloud: which of its sides is one, if any, by the geometry."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from graspe_data.arrays import Floats

# No lidar has more rings.
_MOST_RINGS: Final = 512
# Points of a line that are looked at, and how many of them it needs to say anything.
_SAMPLES, _FEWEST = 128, 4
# Of the mean angle between lines: a ring scatters less about its cone.
_STRAIGHT: Final = 0.25
# Of the same: lines that are nearer to each other are one ring.
_SAME: Final = 0.1
# A cone fits a ring so much better (by squares) than a plane through the sensor; of a picture's
# row and of a firing the plane fits better.
_CONE_OVER_PLANE: Final = 0.25
# Metres: nearer returns tell less of the direction, since beams start beside the sensor's centre.
_NEAR: Final = 2.0


def organised_rings(
    x: NDArray[np.floating], y: NDArray[np.floating], z: NDArray[np.floating]
) -> NDArray[np.int32] | None:
    """Number the points of an organised cloud by its lines, if these are rings.

    The returns of one ring lie on a cone about the axis of the sensor: their elevation does not
    change, whatever they hit and however the sensor is tilted. A row of a depth camera's picture
    and a firing of a spinning lidar lie in a plane through the sensor instead.

    Args:
        x: Coordinates (H, W), metres, from the sensor; not finite or at the origin: no return.
        y: As x.
        z: As x.

    Returns:
        int32 (H * W,), the row or the column; None where neither side is a ring.
    """
    height, width = x.shape
    if min(height, width) <= 1:
        return None
    rows = _as_cones(*_sampled(x, y, z, height, width))
    columns = _as_cones(*_sampled(x.T, y.T, z.T, width, height))
    index = np.arange(height * width, dtype=np.int32)
    if rows is not None and (columns is None or rows.scatter <= columns.scatter):
        return rows.numbers()[index // np.int32(width)]
    return None if columns is None else columns.numbers()[index % np.int32(width)]


@dataclass(frozen=True)
class _Cones:
    """The lines of a side as cones.

    ``heights`` (L,): sines of their elevation above the sensor's equator, NaN where a line has too
    few returns. ``between``: the mean step from one to the next. ``scatter``: of it.
    """

    heights: Floats
    between: float
    scatter: float

    def numbers(self) -> NDArray[np.int32]:
        """A number for each line: its own, or that of the first one at the same elevation.

        The second returns of a dual cloud make lines of their own on the cones of the first ones.
        """
        numbers = np.arange(len(self.heights), dtype=np.int32)
        known = np.flatnonzero(~np.isnan(self.heights))
        order = known[np.argsort(self.heights[known], kind="stable")]
        starts = np.diff(self.heights[order], prepend=-np.inf) > _SAME * self.between
        firsts = np.minimum.reduceat(order, np.flatnonzero(starts))
        numbers[order] = firsts[np.cumsum(starts) - 1]
        return numbers


def _sampled(
    x: NDArray[np.floating],
    y: NDArray[np.floating],
    z: NDArray[np.floating],
    lines: int,
    points: int,
) -> tuple[Floats, Floats]:
    """Unit directions (L, S, 3) and weights (L, S) of some points of every line."""
    if lines > _MOST_RINGS:
        return np.empty((0, 0, 3)), np.empty((0, 0))
    chosen = np.unique(np.linspace(0, points - 1, min(points, _SAMPLES)).astype(np.intp))
    xyz = np.stack([axis[:, chosen].astype(np.float64) for axis in (x, y, z)], axis=-1)
    xyz[~np.isfinite(xyz).all(axis=-1)] = 0.0
    distance = np.sqrt((xyz**2).sum(axis=-1))
    weight = distance**2 / (distance**2 + _NEAR**2)
    return xyz / np.maximum(distance, np.finfo(np.float32).tiny)[..., None], weight


@dataclass(frozen=True)
class _Moments:
    """Of each line: weight (L,), mean direction (L, 3), second moments (L, 3, 3)."""

    weight: Floats
    mean: Floats
    second: Floats


def _as_cones(directions: Floats, weight: Floats) -> _Cones | None:
    """Fit cones of one axis to the lines; None where these are no rings."""
    useful = np.count_nonzero(weight, axis=-1) >= _FEWEST
    if np.count_nonzero(useful) <= 1:
        return None
    moments = _moments(directions[useful], weight[useful])
    spread = moments.second - moments.mean[:, :, None] * moments.mean[:, None, :]
    total = moments.weight[:, None, None] * spread
    axis = np.linalg.eigh(total.sum(axis=0))[1][:, 0]
    share = moments.weight / moments.weight.sum()
    cone = float(share @ np.einsum("i,lij,j->l", axis, spread, axis).clip(min=0))
    plane = float(share @ np.linalg.eigvalsh(moments.second)[:, 0].clip(min=0))
    heights = np.full(len(useful), np.nan)
    heights[useful] = moments.mean @ axis
    between = float(np.ptp(heights[useful])) / (np.count_nonzero(useful) - 1)
    scatter = float(np.sqrt(cone))
    if cone >= _CONE_OVER_PLANE * plane or scatter >= _STRAIGHT * between:
        return None
    return _Cones(heights, between, scatter / between)


def _moments(directions: Floats, weight: Floats) -> _Moments:
    total = weight.sum(axis=-1)
    part = weight / total[:, None]
    mean = np.einsum("ls,lsi->li", part, directions)
    return _Moments(total, mean, np.einsum("ls,lsi,lsj->lij", part, directions, directions))
