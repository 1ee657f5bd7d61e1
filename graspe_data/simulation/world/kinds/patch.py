"""What lies flat on the ground: mud and water hold, fallen leaves and paint do nothing."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from typing import Annotated, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

from graspe_data.simulation.world.feature import Range, RoundFeature, between, draw
from graspe_data.simulation.world.kinds.volumes import in_discs, leaf_counts
from graspe_data.simulation.world.materials import Effect, MaterialName
from graspe_data.simulation.world.mesh import Mesh
from graspe_data.simulation.world.plan import Plan, Spots
from graspe_data.simulation.world.shapes.drape import PATCH_TRIANGLES, patches, surface_height
from graspe_data.simulation.world.shapes.leaves import LEAF_TRIANGLES, leaf_area, leaves
from graspe_data.simulation.world.world import Ground

LEAF_LENGTH, LEAF_WIDTH = 0.07, 0.045
LEAVES_PER_M2 = 130.0
HEAP = 0.03
"""Metres; the highest middle of a fallen leaf."""


class _Patch(RoundFeature):
    radius: Annotated[Range, between(0.1, 10.0)] = (0.6, 1.6)
    """Metres, at the widest."""


class Mud(_Patch):
    """Soft ground in which a robot sinks in and is held; it lies as flat as what is around."""

    kind: Literal["mud"] = "mud"
    effect: ClassVar[Effect] = "entangles"
    material: ClassVar[MaterialName] = "mud"

    give: Annotated[Range, between(0.02, 2.0)] = (0.15, 0.35)
    """Way in metres over which it takes the speed down to 1 / e."""


class Water(_Patch):
    """A pool that mirrors the sky and in which a robot is held; turbid, so that a beam returns."""

    kind: Literal["water"] = "water"
    effect: ClassVar[Effect] = "entangles"
    material: ClassVar[MaterialName] = "water"

    give: Annotated[Range, between(0.02, 2.0)] = (0.2, 0.4)
    """Way in metres over which it takes the speed down to 1 / e."""


class Litter(_Patch):
    """Fallen leaves that lie flat: they look like something that grows there, and do nothing."""

    kind: Literal["litter"] = "litter"
    effect: ClassVar[Effect] = "free"
    material: ClassVar[MaterialName] = "litter"


class Paint(_Patch):
    """Paint on the ground: it looks like a thing, and does nothing."""

    kind: Literal["paint"] = "paint"
    effect: ClassVar[Effect] = "free"
    material: ClassVar[MaterialName] = "paint"

    radius: Annotated[Range, between(0.1, 10.0)] = (0.2, 0.6)
    """Metres, at the widest."""


def plan_patches(
    feature: Mud | Water | Litter | Paint,
    spots: Spots,
    ground: Ground,
    generator: np.random.Generator,
) -> Plan:
    """Draw how far patches hold, and lay them on the ground."""
    give = draw(feature.give, len(spots), generator) if isinstance(feature, Mud | Water) else 0.0
    obstacles = spots.obstacles(feature.effect, feature.material, give)
    fallen = _fallen(feature, spots)
    triangles = PATCH_TRIANGLES * len(spots) + LEAF_TRIANGLES * int(fallen.sum())
    make = partial(_make, feature.material, spots, fallen, ground, generator)
    return Plan(obstacles, triangles, make)


def _fallen(feature: _Patch, spots: Spots) -> NDArray[np.int64]:
    density = LEAVES_PER_M2 * leaf_area(LEAF_LENGTH, LEAF_WIDTH)
    area = np.pi * spots.radius**2 * isinstance(feature, Litter)
    return leaf_counts(np.array(density), area, leaf_area(LEAF_LENGTH, LEAF_WIDTH))


def _make(
    material: MaterialName,
    spots: Spots,
    fallen: NDArray[np.int64],
    ground: Ground,
    generator: np.random.Generator,
) -> Iterator[Mesh]:
    yield patches(spots, ground, material, generator)
    owner = np.repeat(np.arange(len(spots)), fallen)
    places = spots.start[owner] + spots.radius[owner, None] * in_discs(fallen, generator)
    height = surface_height(ground, *places.T) + generator.uniform(0.0, HEAP, len(places))
    middle = np.column_stack([places, height])
    yield leaves(middle, LEAF_LENGTH, LEAF_WIDTH, material, generator)
