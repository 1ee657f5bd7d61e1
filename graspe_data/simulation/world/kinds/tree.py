"""Trees."""

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

LEAF_LENGTH, LEAF_WIDTH = 0.14, 0.09
TRUNK_POINTS, TRUNK_SIDES = 7, 12
BRANCHES, BRANCH_POINTS, BRANCH_SIDES = 7, 3, 5
ROOT = 0.2
TRUNK_SHARE = 0.85


class Tree(RoundFeature):
    """A trunk that stops, and a crown above the robot."""

    kind: Literal["tree"] = "tree"
    effect: ClassVar[Effect] = "stops"
    material: ClassVar[MaterialName] = "bark"

    radius: Annotated[Range, between(0.02, 1.0)] = (0.08, 0.3)
    """Of the trunk at the ground, metres."""
    height: Annotated[Range, between(1.0, 20.0)] = (3.0, 7.0)
    """Metres."""
    crown_base: Annotated[Range, between(0.3, 8.0)] = (1.6, 2.2)
    """Height in metres of the lowest leaves; at most 0.7 of the tree's height."""
    crown_radius: Annotated[Range, between(0.2, 5.0)] = (0.9, 1.9)
    """Metres."""
    leaf_area_density: Annotated[Range, between(0.0, 10.0)] = (0.7, 1.3)
    """Of the crown: m2 of leaf, one side, per m3."""


@dataclass(frozen=True)
class _Drawn:
    foot: Floats
    radius: Floats
    height: Floats
    base: Floats
    crown: Floats
    leaves: NDArray[np.int64]


def plan_trees(feature: Tree, spots: Spots, ground: Ground, generator: np.random.Generator) -> Plan:
    """Draw sizes and leaves of trees on their spots."""
    spans = feature.height, feature.crown_base, feature.crown_radius, feature.leaf_area_density
    height, base, crown, density = (draw(span, len(spots), generator) for span in spans)
    base = np.minimum(base, 0.7 * height)
    volume = 4 / 3 * np.pi * crown**2 * (height - base) / 2
    count = leaf_counts(density, volume, leaf_area(LEAF_LENGTH, LEAF_WIDTH))
    foot = np.column_stack([spots.start, ground.height(*spots.start.T)])
    drawn = _Drawn(foot, spots.radius, height, base, crown, count)
    wood = 2 * (TRUNK_POINTS - 1) * TRUNK_SIDES
    wood += BRANCHES * 2 * (BRANCH_POINTS - 1) * BRANCH_SIDES
    triangles = wood * len(spots) + LEAF_TRIANGLES * int(count.sum())
    obstacles = spots.obstacles("stops", "bark")
    return Plan(obstacles, triangles, partial(_make, drawn, generator))


def _make(tree: _Drawn, generator: np.random.Generator) -> Iterator[Mesh]:
    lean = generator.normal(0.0, 0.05, (len(tree.foot), 2)) * tree.height[:, None]
    up = np.repeat(np.linspace(0.0, 1.0, TRUNK_POINTS)[None], len(tree.foot), axis=0)
    paths = _on_trunk(tree, lean, up)
    paths[:, 0, 2] -= ROOT
    yield tubes(paths, tree.radius[:, None] * (1 - 0.7 * up), TRUNK_SIDES, "bark")
    yield _branches(tree, lean, generator)
    centres = in_balls(tree.leaves, generator)
    middle = _on_trunk(tree, lean, np.full((len(lean), 1), 0.7))[:, 0]
    middle[:, 2] = tree.foot[:, 2] + (tree.base + tree.height) / 2
    size = np.column_stack([tree.crown, tree.crown, (tree.height - tree.base) / 2])
    centres *= np.repeat(size.astype(np.float32), tree.leaves, axis=0)
    centres += np.repeat(middle.astype(np.float32), tree.leaves, axis=0)
    yield leaves(centres, LEAF_LENGTH, LEAF_WIDTH, "leaf", generator)


def _on_trunk(tree: _Drawn, lean: Floats, up: Floats) -> Floats:
    """Points (N, K, 3) at shares (N, K) of the trunk's length; it bends, but not at its foot."""
    points = np.repeat(tree.foot[:, None], up.shape[1], axis=1)
    points[..., :2] += lean[:, None] * (np.maximum(up - 0.1, 0.0) ** 2)[..., None]
    points[..., 2] += up * (TRUNK_SHARE * tree.height)[:, None]
    return points


def _branches(tree: _Drawn, lean: Floats, generator: np.random.Generator) -> Mesh:
    shape = (len(lean), BRANCHES)
    lowest = 0.8 * tree.base / (TRUNK_SHARE * tree.height)
    up = lowest[:, None] + generator.uniform(0.0, 1.0, shape) * (0.95 - lowest)[:, None]
    azimuth = generator.uniform(0.0, 2 * np.pi, shape)
    slope = generator.uniform(0.2, 0.8, shape)
    out = np.stack([np.cos(azimuth), np.sin(azimuth), slope], axis=-1)
    out *= (0.75 * tree.crown)[:, None, None] * (1.1 - up)[..., None]
    first = _on_trunk(tree, lean, up).reshape(-1, 3)
    last = first + out.reshape(-1, 3)
    middle = (first + last) / 2 - [0.0, 0.0, 0.05]
    radius = (tree.radius[:, None] * (1 - 0.7 * up) * 0.5).reshape(-1)
    tapered = np.column_stack([radius, 0.7 * radius, 0.2 * radius])
    return tubes(np.stack([first, middle, last], axis=1), tapered, BRANCH_SIDES, "bark")
