"""Pillars."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from typing import Annotated, ClassVar, Literal

import numpy as np

from graspe_data.arrays import Floats
from graspe_data.simulation.world.feature import Range, RoundFeature, between, draw
from graspe_data.simulation.world.materials import Effect, MaterialName
from graspe_data.simulation.world.mesh import Mesh
from graspe_data.simulation.world.plan import Plan, Spots
from graspe_data.simulation.world.shapes.tubes import tubes
from graspe_data.simulation.world.world import Ground

SIDES = 24
SUNK = 0.2


class Pillar(RoundFeature):
    """A smooth upright cylinder that stops."""

    kind: Literal["pillar"] = "pillar"
    effect: ClassVar[Effect] = "stops"
    material: ClassVar[MaterialName] = "pillar"

    radius: Annotated[Range, between(0.02, 2.0)] = (0.15, 0.35)
    """Metres."""
    height: Annotated[Range, between(0.2, 20.0)] = (2.5, 3.5)
    """Metres."""


def plan_pillars(
    feature: Pillar, spots: Spots, ground: Ground, generator: np.random.Generator
) -> Plan:
    """Draw the heights of pillars on their spots."""
    height = draw(feature.height, len(spots), generator)
    foot = np.column_stack([spots.start, ground.height(*spots.start.T)])
    make = partial(_make, foot, spots.radius, height)
    return Plan(spots.obstacles("stops", "pillar"), len(spots) * 4 * SIDES, make)


def _make(foot: Floats, radius: Floats, height: Floats) -> Iterator[Mesh]:
    levels = np.column_stack([np.full(len(foot), -SUNK), height, height])
    paths = np.repeat(foot[:, None], 3, axis=1)
    paths[..., 2] += levels
    yield tubes(paths, radius[:, None] * [1.0, 1.0, 0.0], SIDES, "pillar")
