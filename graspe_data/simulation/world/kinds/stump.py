"""Stumps, lower than a lidar's lowest beam."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from typing import Annotated, ClassVar, Literal

import numpy as np

from graspe_data.arrays import Floats
from graspe_data.simulation.world.feature import Range, RoundFeature, between, draw
from graspe_data.simulation.world.materials import Effect, MaterialName
from graspe_data.simulation.world.mesh import Mesh, mesh_of
from graspe_data.simulation.world.plan import Plan, Spots
from graspe_data.simulation.world.shapes.tubes import tubes
from graspe_data.simulation.world.world import Ground

SIDES = 16
SUNK = 0.2
STUMP_TRIANGLES = 3 * SIDES


class Stump(RoundFeature):
    """What a sawn trunk leaves: bark around pale wood, over which a legged robot stumbles.

    From 0.85 m above the ground, a lowest beam of -15 degrees passes over 0.15 m at 2.6 m.
    """

    kind: Literal["stump"] = "stump"
    effect: ClassVar[Effect] = "stumbles"
    material: ClassVar[MaterialName] = "bark"

    radius: Annotated[Range, between(0.05, 0.6)] = (0.1, 0.25)
    """Metres."""
    height: Annotated[Range, between(0.02, 0.5)] = (0.08, 0.15)
    """Above the ground, metres; what makes the robot stumble."""


def plan_stumps(
    feature: Stump, spots: Spots, ground: Ground, generator: np.random.Generator
) -> Plan:
    """Draw the heights of stumps on their spots."""
    height = draw(feature.height, len(spots), generator)
    foot = np.column_stack([spots.start, ground.height(*spots.start.T)])
    obstacles = spots.obstacles("stumbles", "bark", height)
    return Plan(obstacles, len(spots) * STUMP_TRIANGLES, partial(_make, foot, spots.radius, height))


def _make(foot: Floats, radius: Floats, height: Floats) -> Iterator[Mesh]:
    paths = np.repeat(foot[:, None], 2, axis=1)
    paths[..., 2] += np.column_stack([np.full(len(foot), -SUNK), height])
    yield tubes(paths, np.repeat(radius[:, None], 2, axis=1), SIDES, "bark")
    yield _tops(paths[:, 1], radius)


def _tops(middle: Floats, radius: Floats) -> Mesh:
    """A level fan of wood on each stump."""
    angle = 2 * np.pi * np.arange(SIDES) / SIDES
    rim = np.repeat(middle[:, None], SIDES, axis=1)
    rim[..., 0] += radius[:, None] * np.cos(angle)
    rim[..., 1] += radius[:, None] * np.sin(angle)
    corners = np.concatenate([middle[:, None], rim], axis=1)
    around = np.arange(SIDES, dtype=np.uint32)
    fan = np.column_stack([np.zeros(SIDES, np.uint32), 1 + around, 1 + (around + 1) % SIDES])
    first = np.uint32(1 + SIDES) * np.arange(len(middle), dtype=np.uint32)[:, None, None]
    return mesh_of(corners.reshape(-1, 3), (first + fan).reshape(-1, 3), "wood")
