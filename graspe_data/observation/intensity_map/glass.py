"""Transparent obstacles in one cloud: the difference of two layers."""

from __future__ import annotations

import math
from typing import Annotated, Self

import cv2
import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from graspe_data.errors import ObservationError
from graspe_data.manifest import Settings
from graspe_data.observation.intensity_map.classes import CellClasses

Map = NDArray[np.float32]
Cells = tuple[NDArray[np.int64], NDArray[np.int64]]


class GlassSettings(Settings):
    """Which layers glass is looked for in, and how long it is remembered."""

    low: Annotated[int, Field(ge=0)] = 0
    """The layer just below the lidar's plane, counted from 0."""
    middle: Annotated[int, Field(ge=0)] = 1
    """The layer about the lidar's plane, in which glass returns a little."""
    margin: Annotated[int, Field(ge=0, le=20)] = 0
    """Cells that the low layer also counts in all around; 0 is the printed difference."""
    extend: Annotated[int, Field(ge=0, le=100)] = 0
    """Cells by which a glint stands for the pane about it, to both sides; see ``extend_glass``."""
    smallest: Annotated[int, Field(ge=1, le=1000)] = 4
    """Cells of a glint from which it is extended."""
    memory_s: Annotated[float, Field(gt=0)] = 7.5
    """Time constant of forgetting: 25 updates of every third cloud at 10 Hz."""
    faintest: Annotated[float, Field(ge=0, lt=1)] = 0.02
    """What is remembered more faintly is forgotten, of the sensor's maximum."""

    @model_validator(mode="after")
    def _two_layers(self) -> Self:
        if self.low == self.middle:
            raise ValueError(f"low and middle are both layer {self.low}, and must differ")
        return self


def glass_layer(layers: Map, settings: GlassSettings) -> Map:
    """Keep what the middle layer has and the low one has not.

    I_FN = max(0, I_mid - I_low), cell by cell (section IV-B2, inline): glass returns a beam only
    where it meets the pane squarely, in the lidar's plane; what stands in both layers cancels.

    Args:
        layers: float32 (layers, cells, cells), 0..1; see ``intensity_layers``.
        settings: Which layers.

    Returns:
        float32 (cells, cells), 0..1.

    Raises:
        ObservationError: The map has no such layer.
    """
    if max(settings.low, settings.middle) >= len(layers):
        raise ObservationError(
            f"Glass is looked for in layers {settings.low} and {settings.middle}, and the map has "
            f"{len(layers)}, counted from 0: correct `low` and `middle`, or add intervals."
        )
    low = _grown(layers[settings.low], settings.margin)
    left: Map = np.maximum(layers[settings.middle] - low, np.float32(0))
    return left


def extend_glass(
    glass: Map,
    layers: Map,
    classes: CellClasses,
    eye: tuple[float, float],
    settings: GlassSettings,
) -> Map:
    """Draw the pane about each glint: a line through its centre, square to the line of sight.

    A pane sends a beam back only where it meets it squarely, so that much of it is never seen, and
    that much is sure of its direction. Frames interrupt panes, but where something pliable hangs
    that is as strong in the low layer is a doorway: there the line ends. From a later program of the paper's
    authors, which draws 20 cells to each side; the paper does not have it.

    Args:
        glass: float32 (n, n), 0..1, of one cloud; see ``glass_layer``.
        layers: What it was made of.
        classes: Of the cells of the same cloud. What is pliable within the margin of something
            solid is its rim, and no doorway.
        eye: Row and column of the lidar, which may be fractions.
        settings: ``extend``, ``smallest``; below ``faintest`` is no glint.

    Returns:
        float32 (n, n): no cell is lower than before, those of a line as high as its glint's
        greatest.
    """
    if not settings.extend:
        return glass
    glints = (glass > np.float32(settings.faintest)).astype(np.uint8)
    count, label, stats, centres = cv2.connectedComponentsWithStats(glints, connectivity=8)
    rims = _grown(classes.true_positive, settings.margin) > 0
    low, middle = layers[settings.low], layers[settings.middle]
    hangs = (classes.false_positive > 0) & (low > 0) & (low >= middle)
    doorway, drawn = hangs & ~rims, glass.copy()
    for each in range(1, count):
        left, top, width, height, area = stats[each].tolist()
        if area >= settings.smallest:
            box = np.s_[top : top + height, left : left + width]
            strength = glass[box][label[box] == each].max()
            column, row = centres[each].tolist()
            for cells in _square_to_sight((row, column), eye, settings.extend, len(glass)):
                shut = np.flatnonzero(doorway[cells])
                clear = tuple(place[: shut[0]] if len(shut) else place for place in cells)
                drawn[clear] = np.maximum(drawn[clear], strength)
    return drawn


def _grown(cells: Map, by: int) -> Map:
    """The greatest value within so many cells, to all sides."""
    kernel = np.ones((2 * by + 1, 2 * by + 1), np.uint8)
    return np.asarray(cv2.dilate(cells, kernel), np.float32) if by else cells


def _square_to_sight(
    centre: tuple[float, float], eye: tuple[float, float], reach: int, side: int
) -> tuple[Cells, Cells]:
    """The cells of two lines from a centre outwards, in half-cell steps: rows and columns."""
    down, right = centre[0] - eye[0], centre[1] - eye[1]
    distance = math.hypot(down, right) or 1.0
    along = np.arange(2 * reach + 1) / 2
    lines = []
    for sign in (-1, 1):
        row = np.rint(centre[0] - sign * along * right / distance).astype(np.int64)
        column = np.rint(centre[1] + sign * along * down / distance).astype(np.int64)
        inside = (row >= 0) & (row < side) & (column >= 0) & (column < side)
        lines.append((row[inside], column[inside]))
    return lines[0], lines[1]
