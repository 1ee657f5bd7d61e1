"""Transparent obstacles in one cloud: the difference of two layers."""

from __future__ import annotations

from typing import Annotated, Self

import cv2
import numpy as np
from pydantic import Field, model_validator

from graspe_data.arrays import Map
from graspe_data.errors import ObservationError
from graspe_data.manifest import Settings


class GlassSettings(Settings):
    """Which layers glass is looked for in, and how long it is remembered."""

    low: Annotated[int, Field(ge=0)] = 0
    """The layer just below the lidar's plane, counted from 0."""
    middle: Annotated[int, Field(ge=0)] = 1
    """The layer about the lidar's plane, in which glass returns a little."""
    margin: Annotated[int, Field(ge=0, le=20)] = 0
    """Cells that the low layer also counts in all around; 0 is the printed difference."""
    extend: Annotated[int, Field(ge=0, le=100)] = 0
    """Cells by which a glint stands for the pane about it, to both sides; see ``panes``."""
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
    low = grown(layers[settings.low], settings.margin)
    left: Map = np.maximum(layers[settings.middle] - low, np.float32(0))
    return left


def grown(cells: Map, by: int) -> Map:
    """The greatest value within so many cells, to all sides; float32 (n, n)."""
    kernel = np.ones((2 * by + 1, 2 * by + 1), np.uint8)
    return np.asarray(cv2.dilate(cells, kernel), np.float32) if by else cells
