"""The grid that intensity maps lie on, and how the dataset keeps layers on it."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from graspe_data.manifest import Settings


class GridSettings(Settings):
    """A square grid about the robot: row 0 lies ahead, column 0 to the left."""

    cells: Annotated[int, Field(ge=2, le=1000)] = 200
    """Along each side."""
    cell_m: Annotated[float, Field(gt=0, le=10)] = 0.05
    """Side of a cell, metres."""


def cells_of(
    x: NDArray[np.float32], y: NDArray[np.float32], grid: GridSettings
) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.bool_]]:
    """The cells that points lie in.

    A row holds x in (half - (row + 1) cell, half - row cell], half being half the grid's side, and
    a column y likewise: index = floor((half - x) / cell), the floor of equation (1), reckoned in
    float32.

    Args:
        x: Forward, (N,), metres, base_link.
        y: To the left, (N,), metres.
        grid: The grid.

    Returns:
        Row and column, whole numbers as float32 (N,), and which points lie on the grid at all.
    """
    half, cell = np.float32(grid.cells * grid.cell_m / 2), np.float32(grid.cell_m)
    row, column = np.floor((half - x) / cell), np.floor((half - y) / cell)
    inside = (row >= 0) & (row < grid.cells) & (column >= 0) & (column < grid.cells)
    return row, column, inside


STEPS = 255
_SLACK = 1e-3


def store_layers(layers: NDArray[np.float32]) -> NDArray[np.uint8]:
    """Layers 0..1 as bytes 0..255, rounded up.

    Nothing is lost for sums and maxima of an 8-bit lidar such as the VLP-16; with float16 a row
    would be twice the size for no more. Rounding up keeps every cell that has a return apart from
    the empty ones, however faint.
    """
    scaled: NDArray[np.float32] = np.ceil(layers * np.float32(STEPS) - np.float32(_SLACK))
    return scaled.astype(np.uint8)


def restore_layers(stored: NDArray[np.uint8]) -> NDArray[np.float32]:
    """Bytes 0..255 as layers 0..1."""
    return stored.astype(np.float32) / np.float32(STEPS)
