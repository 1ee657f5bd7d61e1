"""The pane about a glint, of which a lidar sees only what it looks at squarely."""

from __future__ import annotations

import math

import cv2
import numpy as np
from numpy.typing import NDArray

from graspe_data.arrays import Map, Mask
from graspe_data.observation.intensity_map.classes import CellClasses
from graspe_data.observation.intensity_map.glass import GlassSettings, grown

Cells = tuple[NDArray[np.int64], NDArray[np.int64]]
Point = tuple[float, float]


def extend_glass(
    glass: Map, layers: Map, classes: CellClasses, eye: Point, settings: GlassSettings
) -> Map:
    """Draw the pane about each glint: a line through its centre, square to the line of sight.

    A pane sends a beam back only where it meets it squarely, so that much of it is never seen, and
    that much is sure of its direction. Frames interrupt panes, but where something pliable hangs
    that is as strong in the low layer is a doorway: there the line ends. From a later program of
    the paper's authors, which draws 20 cells to each side; the paper does not have it.

    Args:
        glass: float32 (n, n), 0..1, of one cloud; see ``glass_layer``.
        layers: What it was made of.
        classes: Of the cells of the same cloud. What is pliable within the margin of something
            solid is its rim, and no doorway.
        eye: Row and column of the lidar, which may be fractions.
        settings: ``extend``, ``smallest``, the layers and the margin; below ``faintest`` is no
            glint.

    Returns:
        float32 (n, n): no cell is lower than before, those of a line at least as high as its
        glint's greatest.
    """
    if not settings.extend:
        return glass
    doorways, drawn = _doorways(layers, classes, settings), glass.copy()
    for centre, strength in _glints(glass, settings):
        for line in _square_to_sight(centre, eye, settings.extend, len(glass)):
            shut = np.flatnonzero(doorways[line])
            end = shut[0] if len(shut) else None
            clear = line[0][:end], line[1][:end]
            drawn[clear] = np.maximum(drawn[clear], strength)
    return drawn


def _glints(glass: Map, settings: GlassSettings) -> list[tuple[Point, np.float32]]:
    """Centre (row, column) and greatest value of each blob of cells that is large enough."""
    bright = (glass > np.float32(settings.faintest)).astype(np.uint8)
    count, label, stats, centres = cv2.connectedComponentsWithStats(bright, connectivity=8)
    glints = []
    for each in range(1, count):
        left, top, width, height, area = stats[each].tolist()
        if area >= settings.smallest:
            box = np.s_[top : top + height, left : left + width]
            column, row = centres[each].tolist()
            glints.append(((row, column), glass[box][label[box] == each].max()))
    return glints


def _doorways(layers: Map, classes: CellClasses, settings: GlassSettings) -> Mask:
    """The cells in which something pliable reaches below the lidar's plane undiminished."""
    low, middle = layers[settings.low], layers[settings.middle]
    hangs = (classes.false_positive > 0) & (low > 0) & (low >= middle)
    return np.asarray(hangs & (grown(classes.true_positive, settings.margin) == 0))


def _square_to_sight(centre: Point, eye: Point, reach: int, side: int) -> tuple[Cells, Cells]:
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
