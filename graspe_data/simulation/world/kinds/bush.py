"""Bushes."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from typing import Annotated, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

from graspe_data.arrays import Floats
from graspe_data.simulation.world.feature import Range, RoundFeature, between, draw
from graspe_data.simulation.world.kinds.volumes import in_balls, leaf_counts
from graspe_data.simulation.world.materials import Effect, MaterialName
from graspe_data.simulation.world.mesh import Mesh
from graspe_data.simulation.world.plan import Plan, Spots
from graspe_data.simulation.world.shapes.leaves import LEAF_TRIANGLES, leaf_area, leaves
from graspe_data.simulation.world.shapes.tubes import tubes
from graspe_data.simulation.world.world import Ground

LEAF_LENGTH, LEAF_WIDTH = 0.07, 0.045
STEMS, STEM_POINTS, STEM_SIDES = 8, 3, 4
ROOT = 0.1


class Bush(RoundFeature):
    """A dome of leaves on stems, in which a robot is caught."""

    kind: Literal["bush"] = "bush"
    effect: ClassVar[Effect] = "entangles"
    material: ClassVar[MaterialName] = "bush"

    radius: Annotated[Range, between(0.1, 5.0)] = (0.3, 0.9)
    """On the ground, metres."""
    height: Annotated[Range, between(0.1, 4.0)] = (0.4, 1.3)
    """Metres."""
    leaf_area_density: Annotated[Range, between(0.0, 30.0)] = (6.0, 10.0)
    """m2 of leaf, one side, per m3."""
    give: Annotated[Range, between(0.02, 2.0)] = (0.1, 0.25)
    """Way in metres over which it takes the speed down to 1 / e."""


@dataclass(frozen=True)
class _Drawn:
    foot: Floats
    radius: Floats
    height: Floats
    leaves: NDArray[np.int64]


def plan_bushes(
    feature: Bush, spots: Spots, ground: Ground, generator: np.random.Generator
) -> Plan:
    """Draw sizes and leaves of bushes on their spots."""
    spans = feature.height, feature.leaf_area_density, feature.give
    height, density, give = (draw(span, len(spots), generator) for span in spans)
    volume = 2 / 3 * np.pi * spots.radius**2 * height
    count = leaf_counts(density, volume, leaf_area(LEAF_LENGTH, LEAF_WIDTH))
    foot = np.column_stack([spots.start, ground.height(*spots.start.T)])
    triangles = LEAF_TRIANGLES * int(count.sum())
    triangles += len(spots) * STEMS * 2 * (STEM_POINTS - 1) * STEM_SIDES
    drawn = _Drawn(foot, spots.radius, height, count)
    obstacles = spots.obstacles("entangles", "bush", give)
    return Plan(obstacles, triangles, partial(_make, drawn, generator))


def _make(bush: _Drawn, generator: np.random.Generator) -> Iterator[Mesh]:
    yield _stems(bush, generator)
    centres = in_balls(bush.leaves, generator)
    np.abs(centres[:, 2], out=centres[:, 2])
    size = np.column_stack([bush.radius, bush.radius, bush.height]).astype(np.float32)
    centres *= np.repeat(size, bush.leaves, axis=0)
    centres += np.repeat(bush.foot.astype(np.float32), bush.leaves, axis=0)
    yield leaves(centres, LEAF_LENGTH, LEAF_WIDTH, "bush", generator)


def _stems(bush: _Drawn, generator: np.random.Generator) -> Mesh:
    """Stems that fan out from near the foot to the dome."""
    shape = (len(bush.foot), STEMS)
    azimuth = generator.uniform(0.0, 2 * np.pi, shape)
    outward = generator.uniform(0.1, 0.7, shape)
    radius, height = bush.radius[:, None], bush.height[:, None]
    flat = np.stack([np.cos(azimuth), np.sin(azimuth)], axis=-1) * radius[..., None]
    tip = np.empty((*shape, 3))
    tip[..., :2] = flat * outward[..., None]
    tip[..., 2] = 0.85 * height * np.sqrt(1 - outward**2)
    low = tip * [0.2, 0.2, 0.0] - [0.0, 0.0, ROOT]
    paths = np.stack([low, (low + tip) / 2, tip], axis=2) + bush.foot[:, None, None]
    radii = np.broadcast_to([0.012, 0.009, 0.004], (len(bush.foot) * STEMS, STEM_POINTS))
    return tubes(paths.reshape(-1, STEM_POINTS, 3), radii, STEM_SIDES, "bush")
