"""What all kinds of features have in common: how many, where, and ranges to draw from."""

from __future__ import annotations

import math
from typing import Annotated, ClassVar, Self

import numpy as np
from pydantic import AfterValidator, Field, model_validator

from graspe_data.arrays import Floats
from graspe_data.manifest import Settings
from graspe_data.simulation.world.materials import Effect, MaterialName

Point = tuple[float, float]
Region = tuple[float, float, float, float]
SHORTEST_LINE = 0.1


def _ordered(values: tuple[float, float]) -> tuple[float, float]:
    if values[0] > values[1]:
        raise ValueError(
            f"the lower end {values[0]:g} is above the upper end {values[1]:g}: swap them"
        )
    return values


def between(lowest: float, highest: float) -> AfterValidator:
    """A check that both ends of a range lie within limits."""

    def check(values: tuple[float, float]) -> tuple[float, float]:
        if values[0] < lowest or values[1] > highest:
            found = f"{values[0]:g} to {values[1]:g}"
            raise ValueError(f"found {found}, expected within {lowest:g} to {highest:g}")
        return values

    return AfterValidator(check)


Range = Annotated[tuple[float, float], AfterValidator(_ordered)]
"""Lower and upper end of a uniform draw."""


def draw(span: Range, count: int, generator: np.random.Generator) -> Floats:
    """Draw uniformly from a range (count,)."""
    return generator.uniform(span[0], span[1], count)


class Feature(Settings):
    """Things of one kind, scattered anew in every world, or placed by the subclass's field."""

    effect: ClassVar[Effect]
    material: ClassVar[MaterialName]

    kind: str
    """Which kind it is."""
    per_100_m2: Annotated[Range, between(0.0, 60.0)] | None = None
    """How many are scattered on 100 m2."""
    within: Region | None = None
    """Lowest x, lowest y, highest x, highest y in metres of where they are scattered."""
    intertwined: bool = False
    """Stands anywhere among other things instead of leaving `clearance` to them."""

    @model_validator(mode="after")
    def _region_has_an_area(self) -> Self:
        if self.within is not None:
            low_x, low_y, high_x, high_y = self.within
            if low_x >= high_x or low_y >= high_y:
                raise ValueError(
                    f"within: found {list(self.within)}, expected lowest x, lowest y, highest x, "
                    "highest y with an area"
                )
        return self


def _one_way(scattered: bool, placed: bool, field: str) -> None:
    if scattered == placed:
        found = "both" if scattered else "neither"
        raise ValueError(f"expected either per_100_m2 or {field}, found {found}")


class RoundFeature(Feature):
    """Things that stand at points."""

    radius: Range
    """On the ground, metres."""
    at: Annotated[tuple[Point, ...], Field(max_length=2000)] = ()
    """Places x, y in metres; instead of `per_100_m2`."""

    @model_validator(mode="after")
    def _scattered_or_placed(self) -> Self:
        _one_way(self.per_100_m2 is not None, bool(self.at), "at")
        return self


class LineFeature(Feature):
    """Things that stand along straight lines."""

    lines: Annotated[tuple[tuple[Point, Point], ...], Field(max_length=500)] = ()
    """Lines from x, y to x, y in metres; instead of `per_100_m2`."""
    length: Annotated[Range, between(0.3, 60.0)] = (3.0, 8.0)
    """Length in metres of those that are scattered."""

    @property
    def half_thickness(self) -> float:
        """Half the thickness in metres on the ground."""
        raise NotImplementedError

    @model_validator(mode="after")
    def _scattered_or_placed(self) -> Self:
        _one_way(self.per_100_m2 is not None, bool(self.lines), "lines")
        for index, (start, end) in enumerate(self.lines):
            if math.dist(start, end) < SHORTEST_LINE:
                raise ValueError(
                    f"lines.{index}: from {list(start)} to {list(end)} is shorter than "
                    f"{SHORTEST_LINE:g} m: give two different ends"
                )
        return self
