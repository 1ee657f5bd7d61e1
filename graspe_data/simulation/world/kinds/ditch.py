"""Ditches: the ground falls away."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field

from graspe_data.arrays import Floats
from graspe_data.simulation.world.capsules import capsule_gaps
from graspe_data.simulation.world.feature import LineFeature, Range, between, draw
from graspe_data.simulation.world.materials import Effect, MaterialName
from graspe_data.simulation.world.plan import Plan, Spots
from graspe_data.simulation.world.streams import stream
from graspe_data.simulation.world.world import Ground

BANK = 0.25
"""Metres over which a side falls to the bottom, at most a third of the width."""
BARE = 0.05
"""Metres of depth from which the soil is bare."""


class Ditch(LineFeature):
    """A ditch that a robot falls into; near by, only what looks down past its edge can see it."""

    kind: Literal["ditch"] = "ditch"
    effect: ClassVar[Effect] = "entangles"
    material: ClassVar[MaterialName] = "ditch"

    width: Annotated[float, Field(ge=0.4, le=5)] = 0.9
    """From edge to edge, metres."""
    depth: Annotated[Range, between(0.1, 1.0)] = (0.3, 0.5)
    """Metres."""
    give: Annotated[Range, between(0.02, 2.0)] = (0.1, 0.15)
    """Way in metres past the edge over which it takes the speed down to 1 / e."""

    @property
    def half_thickness(self) -> float:
        """Half the width in metres."""
        return self.width / 2


def dig(
    features: Sequence[object], spots: Mapping[int, Spots], ground: Ground, name: str, seed: int
) -> Ground:
    """The ground with the ditches of a scenario's world in it; without any, the same ground."""
    for index, feature in enumerate(features):
        if isinstance(feature, Ditch) and len(spots[index]):
            drawn = stream(name, seed, "depths", index)
            ground = _dug(ground, spots[index], draw(feature.depth, len(spots[index]), drawn))
    return ground


def plan_ditches(
    feature: Ditch, spots: Spots, ground: Ground, generator: np.random.Generator
) -> Plan:
    """Draw how ditches hold; their surface is the ground's."""
    del ground
    give = draw(feature.give, len(spots), generator)
    return Plan(spots.obstacles("entangles", "ditch", give), 0, list)


def _dug(ground: Ground, spots: Spots, depth: Floats) -> Ground:
    """Level bottoms and straight sides, within the width."""
    rows, columns = ground.heights.shape
    x = ground.origin[0] + ground.cell * np.arange(columns)
    y = ground.origin[1] + ground.cell * np.arange(rows)
    fall = np.zeros(ground.heights.shape)
    for start, end, radius, deep in zip(spots.start, spots.end, spots.radius, depth, strict=True):
        low, high = np.minimum(start, end) - radius, np.maximum(start, end) + radius
        across, along = (
            slice(*np.searchsorted(axis, (low[k], high[k]))) for k, axis in enumerate((x, y))
        )
        grid = np.stack(np.meshgrid(x[across], y[along]), axis=-1)
        points = Spots(flat := grid.reshape(-1, 2), flat, np.zeros(len(flat)))
        line = Spots(start[None], end[None], np.array([radius]))
        inside = -capsule_gaps(points, line)[:, 0].reshape(grid.shape[:2])
        steep = np.clip(inside / min(BANK, 2 * radius / 3), 0.0, 1.0) * deep
        fall[along, across] = np.maximum(fall[along, across], steep)
    corners = fall > BARE
    bare = corners[:-1, :-1] | corners[:-1, 1:] | corners[1:, :-1] | corners[1:, 1:]
    bare = bare if ground.bare is None else bare | ground.bare
    return replace(ground, heights=ground.heights - fall, bare=bare)
