"""Slip: the share of the legs' speed that does not become motion."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from pydantic import Field

from graspe_data.arrays import Floats
from graspe_data.manifest import Settings


class SlipSettings(Settings):
    """How much slips, and how slowly that changes."""

    mean: Annotated[float, Field(ge=0, le=0.5)] = 0.04
    """Share of the speed."""
    spread: Annotated[float, Field(ge=0, le=0.3)] = 0.02
    """Standard deviation of the share; it stays within 0 and 0.6."""
    change_s: Annotated[float, Field(ge=0.1, le=600)] = 4.0
    """Seconds from one independent value to the next, between which it goes in a straight line."""


def slip_shares(settings: SlipSettings, time_s: Floats, generator: np.random.Generator) -> Floats:
    """The share of the speed lost at each time, float64 (N,)."""
    knots = np.arange(0.0, time_s[-1] + 2 * settings.change_s, settings.change_s)
    drawn = generator.normal(settings.mean, settings.spread, len(knots))
    return np.interp(time_s, knots, np.clip(drawn, 0.0, 0.6))
