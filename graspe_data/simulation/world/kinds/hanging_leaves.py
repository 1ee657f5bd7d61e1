"""Leaves that hang from above into the robot's way."""

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

LEAF_LENGTH, LEAF_WIDTH = 0.11, 0.06
TWIGS, TWIG_POINTS, TWIG_SIDES = 9, 5, 3


class HangingLeaves(RoundFeature):
    """A low branch: leaves in an upright cylinder above the ground, that give way."""

    kind: Literal["hanging_leaves"] = "hanging_leaves"
    effect: ClassVar[Effect] = "free"
    material: ClassVar[MaterialName] = "hanging_leaf"

    radius: Annotated[Range, between(0.1, 5.0)] = (0.5, 1.5)
    """Metres."""
    bottom: Annotated[Range, between(0.0, 8.0)] = (0.5, 0.9)
    """Height in metres of the lowest leaves; from some metres on they only throw shadows."""
    top: Annotated[Range, between(0.5, 10.0)] = (1.8, 2.4)
    """Height in metres of the highest leaves; at least 0.2 above the lowest."""
    leaf_area_density: Annotated[Range, between(0.0, 20.0)] = (1.5, 3.5)
    """m2 of leaf, one side, per m3."""


@dataclass(frozen=True)
class _Drawn:
    foot: Floats
    radius: Floats
    bottom: Floats
    top: Floats
    leaves: NDArray[np.int64]


def plan_hanging_leaves(
    feature: HangingLeaves, spots: Spots, ground: Ground, generator: np.random.Generator
) -> Plan:
    """Draw sizes and leaves of low branches on their spots."""
    spans = feature.bottom, feature.top, feature.leaf_area_density
    bottom, top, density = (draw(span, len(spots), generator) for span in spans)
    top = np.maximum(top, bottom + 0.2)
    volume = np.pi * spots.radius**2 * (top - bottom)
    count = leaf_counts(density, volume, leaf_area(LEAF_LENGTH, LEAF_WIDTH))
    foot = np.column_stack([spots.start, ground.height(*spots.start.T)])
    drawn = _Drawn(foot, spots.radius, bottom, top, count)
    triangles = LEAF_TRIANGLES * int(count.sum())
    triangles += len(spots) * TWIGS * 2 * (TWIG_POINTS - 1) * TWIG_SIDES
    obstacles = spots.obstacles("free", "hanging_leaf")
    return Plan(obstacles, triangles, partial(_make, drawn, generator))


def _make(drawn: _Drawn, generator: np.random.Generator) -> Iterator[Mesh]:
    yield _twigs(drawn, generator)
    across = in_discs(drawn.leaves, generator)
    owner = np.repeat(np.arange(len(drawn.leaves)), drawn.leaves)
    centres = np.empty((len(owner), 3), np.float32)
    centres[:, :2] = drawn.foot[owner, :2] + drawn.radius[owner, None] * across
    height = generator.uniform(drawn.bottom[owner], drawn.top[owner])
    centres[:, 2] = drawn.foot[owner, 2] + height
    yield leaves(centres, LEAF_LENGTH, LEAF_WIDTH, "hanging_leaf", generator)


def _twigs(drawn: _Drawn, generator: np.random.Generator) -> Mesh:
    """Thin twigs that come from above the middle and droop to the rim."""
    shape = (len(drawn.foot), TWIGS, 1)
    azimuth = generator.uniform(0.0, 2 * np.pi, shape)
    reach = generator.uniform(0.5, 0.95, shape) * drawn.radius[:, None, None]
    share = np.linspace(0.0, 1.0, TWIG_POINTS)
    top, low = ((level + drawn.foot[:, 2])[:, None, None] for level in (drawn.top, drawn.bottom))
    paths = np.empty((*shape[:2], TWIG_POINTS, 3))
    paths[..., 0] = drawn.foot[:, None, None, 0] + reach * np.cos(azimuth) * share
    paths[..., 1] = drawn.foot[:, None, None, 1] + reach * np.sin(azimuth) * share
    paths[..., 2] = top + 0.1 - (top + 0.1 - low) * share**2
    radii = np.broadcast_to(np.linspace(0.008, 0.002, TWIG_POINTS), paths.shape[:-1])
    flat = paths.reshape(-1, TWIG_POINTS, 3)
    return tubes(flat, radii.reshape(-1, TWIG_POINTS), TWIG_SIDES, "hanging_leaf")
