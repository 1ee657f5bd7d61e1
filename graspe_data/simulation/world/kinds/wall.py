"""Walls, with or without a door."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from typing import Annotated, ClassVar, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from graspe_data.arrays import Floats
from graspe_data.simulation.world.feature import LineFeature, Range, between, draw
from graspe_data.simulation.world.materials import Effect, MaterialName
from graspe_data.simulation.world.mesh import Mesh
from graspe_data.simulation.world.plan import Plan, Spots
from graspe_data.simulation.world.shapes.beams import BEAM_TRIANGLES, beams
from graspe_data.simulation.world.shapes.lines import line_lengths, line_levels, part_of_lines
from graspe_data.simulation.world.world import Ground

SUNK = 0.2
JAMB = 0.05
"""Metres of wall that stay beside a door at least."""


class _Solid(LineFeature):
    effect: ClassVar[Effect] = "stops"
    material: ClassVar[MaterialName] = "concrete"

    height: Annotated[Range, between(0.1, 20.0)] = (2.2, 3.0)
    """Above the highest ground under it, metres."""
    thickness: Annotated[float, Field(ge=0.02, le=2)] = 0.2
    """Metres."""

    @property
    def half_thickness(self) -> float:
        """Half the thickness in metres."""
        return self.thickness / 2


class Wall(_Solid):
    """A straight wall that stops."""

    kind: Literal["wall"] = "wall"


class Doorway(_Solid):
    """A wall with a door in it."""

    kind: Literal["doorway"] = "doorway"

    gap: Annotated[Range, between(0.3, 10.0)] = (0.8, 1.2)
    """Width of the door in metres."""
    door_height: Annotated[Range, between(0.5, 10.0)] = (2.0, 2.1)
    """Height of the door in metres; the wall goes on above it."""
    position: Annotated[Range, between(0.0, 1.0)] = (0.2, 0.8)
    """Where the door is: 0 at the wall's beginning, 1 at its end."""

    @model_validator(mode="after")
    def _door_fits(self) -> Self:
        lengths = {
            f"lines.{index}": float(np.hypot(end[0] - start[0], end[1] - start[1]))
            for index, (start, end) in enumerate(self.lines)
        } or {"length": self.length[0]}
        for where, length in lengths.items():
            if self.gap[1] + 2 * JAMB > length:
                raise ValueError(
                    f"{where}: a door of up to {self.gap[1]:g} m does not fit into a wall of "
                    f"{length:g} m: make gap narrower or the wall longer"
                )
        return self


def plan_walls(feature: Wall, spots: Spots, ground: Ground, generator: np.random.Generator) -> Plan:
    """Draw the heights of walls on their lines."""
    height = draw(feature.height, len(spots), generator)
    make = partial(_make_walls, spots, height, ground)
    return Plan(_shortened(spots).obstacles("stops", "concrete"), BEAM_TRIANGLES * len(spots), make)


def plan_doorways(
    feature: Doorway, spots: Spots, ground: Ground, generator: np.random.Generator
) -> Plan:
    """Draw heights and doors of walls on their lines."""
    spans = feature.height, feature.door_height, feature.gap, feature.position
    height, door, gap, position = (draw(span, len(spots), generator) for span in spans)
    length = line_lengths(spots)
    first = JAMB + position * (length - gap - 2 * JAMB)
    left = part_of_lines(spots, np.zeros(len(spots)), first)
    right = part_of_lines(spots, first + gap, length)
    lintel = part_of_lines(spots, first, first + gap)
    made = _Doorways(spots, left, right, lintel, height, np.minimum(door, height - 0.05))
    obstacles = [_shortened(side).obstacles("stops", "concrete") for side in (left, right)]
    return Plan(
        obstacles[0] + obstacles[1],
        3 * BEAM_TRIANGLES * len(spots),
        partial(_make_doorways, made, ground),
    )


@dataclass(frozen=True)
class _Doorways:
    whole: Spots
    left: Spots
    right: Spots
    lintel: Spots
    height: Floats
    door: Floats


def _make_walls(spots: Spots, height: Floats, ground: Ground) -> Iterator[Mesh]:
    low, high = line_levels(spots, ground)
    yield _beams(spots, low - SUNK, high + height)


def _make_doorways(made: _Doorways, ground: Ground) -> Iterator[Mesh]:
    low, high = line_levels(made.whole, ground)
    for side in (made.left, made.right):
        yield _beams(side, low - SUNK, high + made.height)
    yield _beams(made.lintel, high + made.door, high + made.height)


def _beams(spots: Spots, low: Floats, high: Floats) -> Mesh:
    start, end = (np.column_stack([end, low]) for end in (spots.start, spots.end))
    return beams(start, end, 2 * spots.radius, high - low, "concrete")


def _shortened(spots: Spots) -> Spots:
    """Capsules that end where the walls end: their round ends lie inside."""
    length = line_lengths(spots)
    radius = np.minimum(spots.radius, length / 2)
    inner = part_of_lines(spots, radius, length - radius)
    return Spots(inner.start, inner.end, radius)
