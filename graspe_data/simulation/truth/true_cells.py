"""Which cells of a map about the robot are barred in the world, and which of them can be seen."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from graspe_data.arrays import Floats, Mask
from graspe_data.simulation.world.obstacles import Obstacles
from graspe_data.simulation.world.world import World

Pose = tuple[float, float, float]


@dataclass(frozen=True)
class TrueCells:
    """Masks bool (n, n) about base_link; row 0 ahead of the robot, column 0 to its left.

    ``barred``: cells that an obstacle's footprint meets. ``visible``: those of them that can be
    seen from the lidar.
    """

    barred: Mask
    visible: Mask


def true_cells(
    world: World, pose: Pose, eye: tuple[float, float], cells: int, cell_m: float
) -> TrueCells:
    """Draw what stops or entangles a robot on a map of cells.

    A cell is barred where its centre is no farther than half a cell from a footprint. It is visible
    where the straight line to it from the lidar, on the ground, first meets barred cells there;
    panes of glass are seen, and seen through. What only slows the robot (tall grass) bars nothing
    and hides nothing: that the lidar cannot look through it counts against a map.

    Args:
        world: Obstacles.
        pose: x, y, yaw of base_link; world frame, metres, rad.
        eye: x, y of the lidar in base_link, metres.
        cells: Along a side of the map.
        cell_m: Side of a cell, metres.
    """
    solid = world.obstacles.having("stops", "entangles")
    glass = np.array([name == "glass" for name in solid.material], np.bool_)
    panes = _drawn(solid, np.flatnonzero(glass), pose, cells, cell_m)
    opaque = _drawn(solid, np.flatnonzero(~glass), pose, cells, cell_m)
    barred = panes | opaque
    return TrueCells(barred, _seen(barred, opaque, eye, cell_m))


def _drawn(
    obstacles: Obstacles, rows: NDArray[np.intp], pose: Pose, cells: int, cell_m: float
) -> Mask:
    """The cells that some of the obstacles meet."""
    drawn = np.zeros((cells, cells), np.bool_)
    centres = (cells / 2 - 0.5 - np.arange(cells, dtype=np.float64)) * cell_m
    for row in rows.tolist():
        a, b = (_from_base(end[row], pose) for end in (obstacles.start, obstacles.end))
        reach = float(obstacles.radius[row]) + cell_m / 2
        low, high = np.minimum(a, b) - reach, np.maximum(a, b) + reach
        # Centres fall from row 0 on.
        x, y = (
            np.flatnonzero((centres >= low[k]) & (centres <= high[k])).astype(np.intp)
            for k in (0, 1)
        )
        near = _distance(centres[x][:, None], centres[y][None, :], a, b) <= reach
        drawn[np.ix_(x, y)] |= near
    return drawn


def _seen(barred: Mask, opaque: Mask, eye: tuple[float, float], cell_m: float) -> Mask:
    """The barred cells up to and with the first opaque one on rays from the eye to all sides."""
    side, seen = len(barred), np.zeros_like(barred)
    # Neighbouring rays are half a cell apart at the map's corners, their samples everywhere.
    reach = side * cell_m / math.sqrt(2) + math.hypot(*eye)
    angles = np.arange(0, 2 * math.pi, cell_m / 2 / reach)[:, None]
    along = np.arange(cell_m / 2, reach, cell_m / 2)
    row, column = (
        np.floor(side / 2 - (start + along * turn) / cell_m).astype(np.int64)
        for start, turn in zip(eye, (np.cos(angles), np.sin(angles)), strict=True)
    )
    inside = (row >= 0) & (row < side) & (column >= 0) & (column < side)
    row, column = np.where(inside, row, 0), np.where(inside, column, 0)
    met = opaque[row, column] & inside
    open_way = np.cumsum(met, axis=1) - met == 0
    shown = barred[row, column] & inside & open_way
    seen[row[shown], column[shown]] = True
    return seen


def _from_base(point: Floats, pose: Pose) -> Floats:
    x, y = point[0] - pose[0], point[1] - pose[1]
    cosine, sine = math.cos(pose[2]), math.sin(pose[2])
    return np.array([cosine * x + sine * y, cosine * y - sine * x])


def _distance(x: Floats, y: Floats, a: Floats, b: Floats) -> Floats:
    """From points to the segment from a to b, metres."""
    along = b - a
    square = float(along @ along)
    share = ((x - a[0]) * along[0] + (y - a[1]) * along[1]) / (square or 1.0)
    share = np.clip(share, 0.0, 1.0)
    away: Floats = np.hypot(x - a[0] - share * along[0], y - a[1] - share * along[1])
    return away
