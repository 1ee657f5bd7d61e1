"""Hanging vines."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from typing import Annotated, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

from graspe_data.arrays import Floats
from graspe_data.simulation.world.feature import Range, RoundFeature, between, draw
from graspe_data.simulation.world.kinds.volumes import in_discs, leaf_counts
from graspe_data.simulation.world.materials import Effect, MaterialName
from graspe_data.simulation.world.mesh import Mesh
from graspe_data.simulation.world.plan import Plan, Spots
from graspe_data.simulation.world.shapes.leaves import LEAF_TRIANGLES, leaf_area, leaves
from graspe_data.simulation.world.shapes.tubes import tubes
from graspe_data.simulation.world.world import Ground

LEAF_LENGTH, LEAF_WIDTH = 0.05, 0.035
STRING_POINTS, STRING_SIDES, STRING_RADIUS = 7, 3, 0.006
SWAY = 0.06
STRAY = 0.03
"""How far leaves sit from their string, metres."""


class Vine(RoundFeature):
    """A clump of leafy strings that hang to the ground, in which a robot is caught."""

    kind: Literal["vine"] = "vine"
    effect: ClassVar[Effect] = "entangles"
    material: ClassVar[MaterialName] = "vine"

    radius: Annotated[Range, between(0.05, 3.0)] = (0.2, 0.6)
    """Of the clump, metres."""
    top: Annotated[Range, between(0.5, 6.0)] = (2.2, 2.8)
    """Height in metres from which the strings hang."""
    bottom: Annotated[Range, between(0.0, 2.0)] = (0.0, 0.3)
    """Height in metres to which they hang; at most 0.2 below the top."""
    strings_per_m2: Annotated[Range, between(1.0, 500.0)] = (25.0, 50.0)
    """Strings on a m2 of ground."""
    leaf_area_density: Annotated[Range, between(0.0, 20.0)] = (1.5, 3.0)
    """m2 of leaf, one side, per m3 of the clump."""
    give: Annotated[Range, between(0.02, 2.0)] = (0.15, 0.35)
    """Way in metres over which it takes the speed down to 1 / e."""


@dataclass(frozen=True)
class _Drawn:
    foot: Floats
    radius: Floats
    bottom: Floats
    top: Floats
    strings: NDArray[np.int64]
    leaves: NDArray[np.int64]


def plan_vines(feature: Vine, spots: Spots, ground: Ground, generator: np.random.Generator) -> Plan:
    """Draw strings and leaves of clumps on their spots."""
    spans = feature.top, feature.bottom, feature.strings_per_m2, feature.leaf_area_density
    top, bottom, strings, density = (draw(span, len(spots), generator) for span in spans)
    bottom = np.minimum(bottom, top - 0.2)
    floor = np.pi * spots.radius**2
    count = leaf_counts(density, floor * (top - bottom), leaf_area(LEAF_LENGTH, LEAF_WIDTH))
    string_count = np.ceil(strings * floor).astype(np.int64)
    foot = np.column_stack([spots.start, ground.height(*spots.start.T)])
    drawn = _Drawn(foot, spots.radius, bottom, top, string_count, count)
    triangles = LEAF_TRIANGLES * int(count.sum())
    triangles += int(string_count.sum()) * 2 * (STRING_POINTS - 1) * STRING_SIDES
    give = draw(feature.give, len(spots), generator)
    obstacles = spots.obstacles("entangles", "vine", give)
    return Plan(obstacles, triangles, partial(_make, drawn, generator))


def _make(drawn: _Drawn, generator: np.random.Generator) -> Iterator[Mesh]:
    paths = _strings(drawn, generator)
    radii = np.full(paths.shape[:2], STRING_RADIUS)
    yield tubes(paths, radii, STRING_SIDES, "vine")
    first = np.cumsum(drawn.strings) - drawn.strings
    owner = np.repeat(np.arange(len(drawn.leaves)), drawn.leaves)
    string = first[owner] + generator.integers(0, drawn.strings[owner])
    level = generator.uniform(0.0, STRING_POINTS - 1.0, len(owner))
    lower = np.minimum(level.astype(np.intp), STRING_POINTS - 2)
    share = (level - lower)[:, None]
    centres = paths[string, lower] * (1 - share) + paths[string, lower + 1] * share
    centres += generator.normal(0.0, STRAY, centres.shape)
    yield leaves(centres, LEAF_LENGTH, LEAF_WIDTH, "vine", generator)


def _strings(drawn: _Drawn, generator: np.random.Generator) -> Floats:
    """Paths (strings, points, 3) from the top down, swaying a little."""
    owner = np.repeat(np.arange(len(drawn.strings)), drawn.strings)
    hung = drawn.radius[owner, None] * in_discs(drawn.strings, generator)
    down = np.linspace(0.0, 1.0, STRING_POINTS)
    paths = np.empty((len(owner), STRING_POINTS, 3))
    sway = generator.normal(0.0, SWAY, (len(owner), STRING_POINTS, 2)) * down[None, :, None]
    paths[..., :2] = (drawn.foot[owner, :2] + hung)[:, None] + sway * 0.5
    top, low = drawn.top[owner, None], drawn.bottom[owner, None]
    low = low + generator.uniform(0.0, 0.5, (len(owner), 1)) * (low > 0)
    paths[..., 2] = drawn.foot[owner, None, 2] + top - (top - low) * down
    return paths
