"""Reliability of a cloud: GrASPE equations (4) and (5)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from graspe_data.manifest import Settings


class PointReliabilitySettings(Settings):
    """Thresholds of c in equation (4) and weights of equation (5).

    Scattered returns count as edges, so the planar share has to weigh far more: with equal
    weights the measure would rise in tall grass.
    """

    planar_below: Annotated[float, Field(ge=0, le=1_000_000)] = 0.01
    edge_above: Annotated[float, Field(ge=0, le=1_000_000)] = 0.1
    edge_weight: Annotated[float, Field(ge=0, le=1000)] = 0.2
    planar_weight: Annotated[float, Field(ge=0, le=1000)] = 1.0

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        low, high = self.planar_below, self.edge_above
        if low > high:
            raise ValueError(f"planar_below {low} is above edge_above {high}")
        return self


@dataclass(frozen=True)
class PointReliability:
    """Shares of edge and planar points and their weighted sum, each in 0..1."""

    r_edge: float
    r_planar: float
    r_point: float


def point_reliability(
    smoothness: NDArray[np.float32], settings: PointReliabilitySettings
) -> PointReliability:
    """Reliability of a cloud from its smoothness.

    Equation (4): r_edge = |{c >= c_max}| / |P|, r_planar = |{c <= c_min}| / |P|.
    Equation (5): r_point = beta_e r_edge + beta_p r_planar, clipped to 0..1.

    Args:
        smoothness: (N,) by ``smoothness``; NaN is padding and does not count.
        settings: Thresholds and weights.

    Returns:
        All 0 for a cloud without points.
    """
    total = int(np.count_nonzero(~np.isnan(smoothness)))
    if total == 0:
        return PointReliability(0.0, 0.0, 0.0)
    r_edge = int(np.count_nonzero(smoothness >= settings.edge_above)) / total
    r_planar = int(np.count_nonzero(smoothness <= settings.planar_below)) / total
    weighted = settings.edge_weight * r_edge + settings.planar_weight * r_planar
    return PointReliability(r_edge, r_planar, min(max(weighted, 0.0), 1.0))
