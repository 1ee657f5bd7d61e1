"""A robot's rectangle as discs."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from graspe_data.manifest import Settings
from graspe_data.robot import Footprint


class BodySettings(Settings):
    """How a footprint becomes discs."""

    shape: Literal["circumscribed", "inscribed", "row"] = "row"
    """One disc around it, one within it, or several along it."""
    count: Annotated[int, Field(ge=1, le=20)] = 3
    """Discs in a row."""
    margin: Annotated[float, Field(ge=0)] = 0.05
    """Metres kept between the footprint and obstacles."""


@dataclass(frozen=True)
class Body:
    """``discs``: (D, 2), offset along x and radius, metres; ``turning_radius``: metres.

    Rotating on the spot, nothing of the robot is farther from base_link than ``turning_radius``.
    """

    discs: NDArray[np.float64]
    turning_radius: float


def body_discs(footprint: Footprint, settings: BodySettings) -> Body:
    """Discs for a rectangle centred on base_link.

    ``circumscribed`` is never optimistic, and as wide as the robot is long (the groups' 0.6 m for
    Spot is that of its 1.1 x 0.5 m). ``inscribed`` is never pessimistic: what it lets through may
    still touch. ``row`` covers the rectangle, so it is never optimistic either, and is nearly as
    narrow as the robot.
    """
    length, width = footprint.length, footprint.width
    around = math.hypot(length, width) / 2
    if settings.shape == "inscribed":
        radius = min(length, width) / 2 + settings.margin
        return Body(np.array([[0.0, radius]]), radius)
    count = settings.count if settings.shape == "row" else 1
    # The rectangle in so many pieces along x, a disc around each.
    part = length / count
    offsets = (np.arange(count) - (count - 1) / 2) * part
    radii = np.full(count, math.hypot(part, width) / 2 + settings.margin)
    return Body(np.stack((offsets, radii), axis=1), around)
