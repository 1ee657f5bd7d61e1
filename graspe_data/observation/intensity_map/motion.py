"""A map carried along as the robot moves: equation (6) of the paper."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Self

import numpy as np

from graspe_data.arrays import Floats, Map

BLOCK = 16_384
"""Cells carried at once: what is reckoned for them stays in the processor's cache."""


@dataclass(frozen=True)
class PlanarMotion:
    """Where a frame goes: metres along the old frame's axes, then a turn to the left in rad."""

    forward: float
    left: float
    turn: float

    @classmethod
    def between(
        cls, earlier: tuple[float, float, float], later: tuple[float, float, float]
    ) -> Self:
        """From one pose to another, each (x, y, yaw) in the odometry frame, metres and rad."""
        x, y, yaw = (after - before for before, after in zip(earlier, later, strict=True))
        cosine, sine = math.cos(earlier[2]), math.sin(earlier[2])
        return cls(cosine * x + sine * y, cosine * y - sine * x, yaw)

    @property
    def inverse(self) -> PlanarMotion:
        """The way back."""
        cosine, sine = math.cos(self.turn), math.sin(self.turn)
        forward = -cosine * self.forward - sine * self.left
        return PlanarMotion(forward, sine * self.forward - cosine * self.left, -self.turn)


def carry_map(values: Map, motion: PlanarMotion, cell_m: float, cells: int | None = None) -> Map:
    """What a map shows after its frame has moved.

    Equation (6): what lies at p in the old frame lies at p' = R(-turn) (p - dp) in the new one.
    Each cell of the new map takes the value of the old cell in which its centre lies,
    p = R(turn) p' + dp (pull, nearest neighbour); where that is off the old map, 0.

    Args:
        values: float32 (n, n), centred on the frame; row 0 ahead, column 0 left.
        motion: Of the frame, from the old one to the new one.
        cell_m: Side of a cell, metres.
        cells: Along a side of the new map; None for as many as the old one has.
    """
    size = cells or len(values)
    centres = size / 2 - 0.5 - np.arange(size, dtype=np.float64)
    # A border of zeros stands for all that is off the map.
    bordered, step = np.pad(values, 1), max(1, BLOCK // size)
    bands = (centres[k : k + step, None] for k in range(0, size, step))
    return np.concatenate([_pulled(bordered, band, centres, motion, cell_m) for band in bands])


def shift_map(values: Map, forward: int, left: int) -> Map:
    """What ``carry_map`` gives for a frame that moves by whole cells, faster."""
    size = len(values)
    moved = np.zeros_like(values)
    if max(abs(forward), abs(left)) >= size:
        return moved
    # What was in row r is in row r + forward.
    (to_row, from_row), (to_column, from_column) = _overlap(forward, size), _overlap(left, size)
    moved[to_row, to_column] = values[from_row, from_column]
    return moved


def _overlap(shift: int, size: int) -> tuple[slice, slice]:
    return (
        slice(max(shift, 0), size + min(shift, 0)),
        slice(max(-shift, 0), size - max(shift, 0)),
    )


def _pulled(
    bordered: Map, ahead: Floats, aside: Floats, motion: PlanarMotion, cell_m: float
) -> Map:
    """The values at the centres of new cells: ahead (k, 1) and aside (n,), in cells."""
    side = len(bordered) - 2
    cosine, sine = math.cos(motion.turn), math.sin(motion.turn)
    x = (cosine * ahead + motion.forward / cell_m) - sine * aside
    y = (sine * ahead + motion.left / cell_m) + cosine * aside
    row, column = (np.clip(side / 2 + 1 - p, 0, side + 1).astype(np.int64) for p in (x, y))
    values: Map = bordered.ravel().take(row * (side + 2) + column)
    return values
