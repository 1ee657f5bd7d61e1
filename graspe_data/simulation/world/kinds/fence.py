"""Fences."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from typing import Annotated, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from graspe_data.arrays import Floats
from graspe_data.simulation.world.feature import LineFeature, Range, between, draw
from graspe_data.simulation.world.materials import Effect, MaterialName
from graspe_data.simulation.world.mesh import Mesh
from graspe_data.simulation.world.plan import Plan, Spots
from graspe_data.simulation.world.shapes.beams import BEAM_TRIANGLES, beams
from graspe_data.simulation.world.shapes.lines import line_lengths
from graspe_data.simulation.world.world import Ground

POST, RAIL_WIDTH, RAIL_HEIGHT = 0.09, 0.03, 0.10
SPACING = 1.8
SUNK = 0.2


class Fence(LineFeature):
    """Posts and rails of wood that stop."""

    kind: Literal["fence"] = "fence"
    effect: ClassVar[Effect] = "stops"
    material: ClassVar[MaterialName] = "wood"

    height: Annotated[Range, between(0.3, 3.0)] = (1.0, 1.3)
    """Of the posts, metres."""
    rails: Annotated[int, Field(ge=1, le=12)] = 3
    """Between two posts, one above the other."""

    @property
    def half_thickness(self) -> float:
        """Half of a post, metres."""
        return POST / 2


def plan_fences(
    feature: Fence, spots: Spots, ground: Ground, generator: np.random.Generator
) -> Plan:
    """Draw the heights of fences on their lines."""
    fields = np.maximum(np.rint(line_lengths(spots) / SPACING), 1).astype(np.int64)
    height = draw(feature.height, len(spots), generator)
    parts = int(fields.sum()) * (1 + feature.rails) + len(spots)
    make = partial(_make, feature.rails, spots, fields, height, ground)
    return Plan(spots.obstacles("stops", "wood"), BEAM_TRIANGLES * parts, make)


def _make(
    rails: int, spots: Spots, fields: NDArray[np.int64], height: Floats, ground: Ground
) -> Iterator[Mesh]:
    owner = np.repeat(np.arange(len(spots)), fields + 1)
    number = np.arange(len(owner)) - np.repeat(np.cumsum(fields + 1) - fields - 1, fields + 1)
    share = (number / fields[owner])[:, None]
    place = spots.start[owner] * (1 - share) + spots.end[owner] * share
    foot = np.column_stack([place, ground.height(*place.T)])
    along = (spots.end - spots.start) / line_lengths(spots)[:, None] * POST / 2
    offset = np.column_stack([along, np.zeros(len(spots))])[owner]
    down = np.array([0.0, 0.0, SUNK])
    yield beams(foot - offset - down, foot + offset - down, POST, height[owner] + SUNK, "wood")
    first = np.flatnonzero(owner[:-1] == owner[1:])
    for rail in range(rails):
        level = height[owner[first], None] * (rail + 0.9) / rails - RAIL_HEIGHT
        up = np.column_stack([np.zeros((len(first), 2)), level])
        yield beams(foot[first] + up, foot[first + 1] + up, RAIL_WIDTH, RAIL_HEIGHT, "wood")
