"""Reliability of a cloud: GrASPE equations (4) and (5), and beside them how much it covers."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Annotated, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from graspe_data.errors import ObservationError
from graspe_data.manifest import Settings


class CoverageSettings(Settings):
    """What returns are expected of the view ahead.

    Ours: as a share of the returns that are left, r_point does not notice those that are lost.
    """

    sectors: Annotated[int, Field(ge=2, le=360)] = 12
    """Of the view, alike in width."""
    half_angle: Annotated[float, Field(gt=0, le=math.pi)] = math.pi / 2
    """rad, of the view to either side."""
    returns: Annotated[int, Field(ge=1, le=1_000_000)] | None = None
    """Expected of each sector, among the points of a row. None expects of each what its fullest
    quarter has: a lost sector is noticed, a cloud that is thin everywhere is not."""


class PointReliabilitySettings(Settings):
    """Thresholds of c in equation (4) and weights of equation (5).

    Scattered returns count as edges, so the planar share has to weigh far more: with equal
    weights the measure would rise in tall grass.
    """

    planar_below: Annotated[float, Field(ge=0, le=1_000_000)] = 0.01
    edge_above: Annotated[float, Field(ge=0, le=1_000_000)] = 0.1
    edge_weight: Annotated[float, Field(ge=0, le=1000)] = 0.2
    planar_weight: Annotated[float, Field(ge=0, le=1000)] = 1.0
    coverage: CoverageSettings | None = None
    """With it r_point of equation (5) is multiplied by the share of the view that is covered."""

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
    smoothness: NDArray[np.float32],
    settings: PointReliabilitySettings,
    points: NDArray[np.float32] | None = None,
) -> PointReliability:
    """Reliability of a cloud from its smoothness.

    Equation (4): r_edge = |{c >= c_max}| / |P|, r_planar = |{c <= c_min}| / |P|.
    Equation (5): r_point = beta_e r_edge + beta_p r_planar, clipped to 0..1.

    Args:
        smoothness: (N,) by ``smoothness``; NaN is padding and does not count.
        settings: Thresholds and weights.
        points: (N, 3), metres, base_link, of the same points; needed where ``settings`` ask for
            coverage.

    Returns:
        All 0 for a cloud without points.

    Raises:
        ObservationError: Coverage is asked for, and there are no points.
    """
    total = int(np.count_nonzero(~np.isnan(smoothness)))
    if total == 0:
        return PointReliability(0.0, 0.0, 0.0)
    r_edge = int(np.count_nonzero(smoothness >= settings.edge_above)) / total
    r_planar = int(np.count_nonzero(smoothness <= settings.planar_below)) / total
    weighted = settings.edge_weight * r_edge + settings.planar_weight * r_planar
    printed = PointReliability(r_edge, r_planar, min(max(weighted, 0.0), 1.0))
    if settings.coverage is None:
        return printed
    if points is None:
        raise ObservationError("point_reliability.coverage: needs the points beside c.")
    return replace(printed, r_point=printed.r_point * coverage(points, settings.coverage))


def coverage(points: NDArray[np.float32], settings: CoverageSettings) -> float:
    """The share of the view ahead that returns as many points as is expected of it, in 0..1.

    Args:
        points: (N, 3), metres, base_link.
        settings: The view and what is expected of it.

    Returns:
        The mean over sectors of min(1, returns / expected); 0 where there are none at all.
    """
    azimuth = np.arctan2(points[:, 1], points[:, 0])
    within = azimuth[np.abs(azimuth) < settings.half_angle]
    share = (within + settings.half_angle) / (2 * settings.half_angle)
    sector = np.minimum((share * settings.sectors).astype(np.int64), settings.sectors - 1)
    returns = np.bincount(sector, minlength=settings.sectors)
    expected = settings.returns or float(np.quantile(returns, 0.75))
    if expected == 0:
        return 0.0
    return float(np.minimum(returns / expected, 1.0).mean())
