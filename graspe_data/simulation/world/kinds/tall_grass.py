"""Tall grass."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from typing import Annotated, ClassVar, Literal, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from graspe_data.arrays import Floats
from graspe_data.simulation.world.feature import Range, RoundFeature, between, draw
from graspe_data.simulation.world.kinds.volumes import in_discs, leaf_counts
from graspe_data.simulation.world.materials import Effect, MaterialName
from graspe_data.simulation.world.mesh import Mesh
from graspe_data.simulation.world.plan import Plan, Spots
from graspe_data.simulation.world.shapes.blades import BLADE_TRIANGLES, FULLNESS, blades
from graspe_data.simulation.world.world import Ground

SHORTEST = 0.6
"""Of the blades of a patch, as a share of the patch's height."""


class TallGrass(RoundFeature):
    """Pliable blades that slow; without `per_100_m2` and `at` they fill `within`, or the arena."""

    kind: Literal["tall_grass"] = "tall_grass"
    effect: ClassVar[Effect] = "slows"
    material: ClassVar[MaterialName] = "grass"

    radius: Annotated[Range, between(0.1, 20.0)] = (1.0, 4.0)
    """Of a patch, metres."""
    height: Annotated[Range, between(0.05, 3.0)] = (0.4, 1.4)
    """Of the highest blades of a patch, metres."""
    leaf_area_density: Annotated[Range, between(0.0, 20.0)] = (0.6, 1.3)
    """m2 of blade, one side, per m3 up to the patch's height."""
    blade_width: Annotated[float, Field(ge=0.002, le=0.1)] = 0.007
    """Metres."""
    lean: Annotated[float, Field(ge=0, le=1)] = 0.35
    """How far tips bend over, as a share of the blade's height, at most."""
    drag: Annotated[float, Field(ge=0, le=5)] = 0.35
    """Share of the speed that is left: exp(-drag * density * height), at least 0.2."""

    @model_validator(mode="after")
    def _scattered_or_placed(self) -> Self:
        if self.per_100_m2 is not None and self.at:
            raise ValueError("expected per_100_m2, or at, or neither to fill within; found both")
        return self

    @property
    def fills(self) -> bool:
        """Whether it fills its region."""
        return self.per_100_m2 is None and not self.at


def plan_tall_grass(
    feature: TallGrass, spots: Spots, ground: Ground, generator: np.random.Generator
) -> Plan:
    """Draw density, height and number of blades for each patch, or one for all that is filled."""
    size = 1 if feature.fills else len(spots)
    height, density = (
        np.broadcast_to(draw(span, size, generator), len(spots))
        for span in (feature.height, feature.leaf_area_density)
    )
    blade = feature.blade_width * height * FULLNESS * (SHORTEST + 1) / 2
    count = leaf_counts(density, _area(spots) * height / blade, 1.0)
    share = np.maximum(np.exp(-feature.drag * density * height), 0.2)
    return Plan(
        spots.obstacles("slows", "grass", share),
        BLADE_TRIANGLES * int(count.sum()),
        partial(_make, feature, spots, height, count, ground, generator),
    )


def _make(
    feature: TallGrass,
    spots: Spots,
    height: Floats,
    count: NDArray[np.int64],
    ground: Ground,
    generator: np.random.Generator,
) -> Iterator[Mesh]:
    places = _places(spots, count, generator)
    feet = np.column_stack([places, ground.height(*places.T)])
    heights = np.repeat(height, count) * generator.uniform(SHORTEST, 1.0, len(feet))
    yield blades(feet, heights, feature.blade_width, feature.lean, "grass", generator)


def _area(spots: Spots) -> Floats:
    length = np.linalg.norm(spots.end - spots.start, axis=1)
    rectangle = (length + 2 * spots.radius) * 2 * spots.radius
    return np.where(length > 0, rectangle, np.pi * spots.radius**2)


def _places(spots: Spots, count: NDArray[np.int64], generator: np.random.Generator) -> Floats:
    """Points, uniform in the disc of a round spot, in the rectangle around a long one."""
    owner = np.repeat(np.arange(len(spots)), count)
    span = (spots.end - spots.start)[owner]
    length = np.linalg.norm(span, axis=1)
    radius = spots.radius[owner]
    round_ = in_discs(count, generator) * radius[:, None]
    along = generator.uniform(-radius, length + radius)
    across = generator.uniform(-radius, radius)
    unit = span / np.maximum(length, 1e-12)[:, None]
    long = unit * along[:, None] + np.column_stack([-unit[:, 1], unit[:, 0]]) * across[:, None]
    places: Floats = spots.start[owner] + np.where(length[:, None] > 0, long, round_)
    return places
