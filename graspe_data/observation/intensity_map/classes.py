"""True positive, false positive and free cells: equations (3) to (5) of the paper."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal, Self

import cv2
import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from graspe_data.arrays import Map
from graspe_data.manifest import Settings


class ClassSettings(Settings):
    """Where pliable ends and solid begins."""

    threshold: Annotated[float, Field(ge=0, lt=1)] = 0.6
    """Gamma, of the sensor's maximum: between thin (below .5) and solid (above .75)."""
    reading: Literal["sum", "each"] = "sum"
    """Of equation (3): the layers' sum is at most Gamma, or each layer is."""
    rim: Annotated[float, Field(ge=0, lt=1)] | None = None
    """A second, lower Gamma for cells beside solid ones, whose beams they share with what lies
    behind; ours, None is as printed."""
    rim_cells: Annotated[int, Field(ge=1, le=20)] = 2
    """How far from a solid cell that is, to all sides."""

    @model_validator(mode="after")
    def _rim_below(self) -> Self:
        if self.rim is not None and self.rim > self.threshold:
            raise ValueError(f"rim {self.rim:g} is above threshold {self.threshold:g}")
        return self


@dataclass(frozen=True)
class CellClasses:
    """Maps float32 (cells, cells), 0..1, whose supports are disjoint; free cells are 0 in both.

    ``true_positive``: solid. ``false_positive``: pliable, to be driven through.
    """

    true_positive: Map
    false_positive: Map

    @property
    def free(self) -> NDArray[np.bool_]:
        """The cells without any return (true negatives), bool (cells, cells)."""
        free: NDArray[np.bool_] = (self.true_positive == 0) & (self.false_positive == 0)
        return free


def classify_cells(layers: Map, settings: ClassSettings) -> CellClasses:
    """Tell solid cells from pliable ones by the intensity of all layers together.

    S = min(1, sum over the layers of I). Equation (3): a cell with 0 < S is a false positive where
    S <= Gamma ("sum"), or where every layer is <= Gamma ("each"). Equation (4): I_TP = S where it
    is not. Equation (5): I_FP = S where it is. With a rim, a cell above it is a true positive as
    well where one of those is near.

    Args:
        layers: float32 (layers, cells, cells), 0..1; see ``intensity_layers``.
        settings: Gamma, the reading of (3), and the rim.
    """
    total = np.minimum(layers.sum(axis=0), np.float32(1))
    judged = total if settings.reading == "sum" else layers.max(axis=0)
    solid = judged > np.float32(settings.threshold)
    if settings.rim is not None:
        side = 2 * settings.rim_cells + 1
        near = cv2.dilate(solid.astype(np.uint8), np.ones((side, side), np.uint8))
        solid |= (judged > np.float32(settings.rim)) & (near > 0)
    return CellClasses(total * solid, total * ~solid)
