"""How right a map of cells is: precision, recall and F-score against the world."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import cv2
import numpy as np
from pydantic import Field

from graspe_data.arrays import Mask
from graspe_data.manifest import Settings
from graspe_data.simulation.truth.true_cells import TrueCells


class CountSettings(Settings):
    """Which cells are counted; distances from base_link, metres."""

    nearest: Annotated[float, Field(ge=0)] = 0.8
    """Nearer cells lie under the robot, or in its lidar's blind spot."""
    farthest: Annotated[float, Field(gt=0)] = 4.0
    """Farther cells are not counted."""
    tolerance: Annotated[int, Field(ge=0, le=20)] = 1
    """Cells, to all sides, by which a map may be off."""


@dataclass(frozen=True)
class CellCounts:
    """``called`` solid by the map, ``right`` of those; ``there`` to be seen, ``found`` of those."""

    called: int = 0
    right: int = 0
    there: int = 0
    found: int = 0

    def __add__(self, other: CellCounts) -> CellCounts:
        """Of both together."""
        return CellCounts(
            self.called + other.called,
            self.right + other.right,
            self.there + other.there,
            self.found + other.found,
        )

    @property
    def precision(self) -> float | None:
        """Share of the called that is right; None where nothing was called solid."""
        return self.right / self.called if self.called else None

    @property
    def recall(self) -> float | None:
        """Share of what was there that was found; None where nothing was there."""
        return self.found / self.there if self.there else None

    @property
    def f_score(self) -> float | None:
        """Harmonic mean of precision and recall; None where one of them is."""
        precision, recall = self.precision, self.recall
        if precision is None or recall is None:
            return None
        both = precision + recall
        return 2 * precision * recall / both if both else 0.0


def count_cells(
    solid: Mask, truth: TrueCells, cell_m: float, settings: CountSettings
) -> CellCounts:
    """Count the cells of one map, those ahead of base_link and within the distances.

    Called are the cells that the map holds for solid (true positives and glass, before inflation);
    all others are passable (free, or pliable). A called cell is right where a barred cell of the
    world is within the tolerance, seen or not: a lidar may see more than the line of sight on the
    ground tells. There are the cells that are barred and visible; such a cell is found where a
    called one is within the tolerance. Cells that are passable in both do not count.

    Args:
        solid: bool (n, n), row 0 ahead, column 0 left, of a map about base_link.
        truth: Of the same size and pose.
        cell_m: Side of a cell, metres.
        settings: See ``CountSettings``.
    """
    counted = _counted(len(solid), cell_m, settings)
    called, there = solid & counted, truth.visible & counted
    right = called & _grown(truth.barred, settings.tolerance)
    found = there & _grown(solid, settings.tolerance)
    return CellCounts(*(int(np.count_nonzero(cells)) for cells in (called, right, there, found)))


def _counted(cells: int, cell_m: float, settings: CountSettings) -> Mask:
    centres = (cells / 2 - 0.5 - np.arange(cells)) * cell_m
    away = np.hypot(centres[:, None], centres[None, :])
    within = (away >= settings.nearest) & (away <= settings.farthest)
    return np.asarray(within & (centres[:, None] > 0), np.bool_)


def _grown(cells: Mask, by: int) -> Mask:
    kernel = np.ones((2 * by + 1, 2 * by + 1), np.uint8)
    return np.asarray(cv2.dilate(cells.astype(np.uint8), kernel) > 0)
