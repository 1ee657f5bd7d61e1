"""Rocks and boulders."""

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
from graspe_data.simulation.world.shapes.balls import ball
from graspe_data.simulation.world.world import Ground

DENT = 0.15
"""How far corners sink in, as a share of the radius, at most."""
FLATNESS = 0.6
"""Exponent of the heights: 1 for a dome, 0 for a block."""


class Rock(RoundFeature):
    """A half-buried rock that makes a legged robot stumble."""

    kind: Literal["rock"] = "rock"
    effect: ClassVar[Effect] = "stumbles"
    material: ClassVar[MaterialName] = "rock"

    radius: Annotated[Range, between(0.03, 0.5)] = (0.08, 0.22)
    """On the ground, metres."""
    height: Annotated[Range, between(0.02, 0.5)] = (0.06, 0.2)
    """Above the ground, metres; what makes the robot stumble."""


class Boulder(RoundFeature):
    """A rock that stops."""

    kind: Literal["boulder"] = "boulder"
    effect: ClassVar[Effect] = "stops"
    material: ClassVar[MaterialName] = "rock"

    radius: Annotated[Range, between(0.1, 4.0)] = (0.3, 0.8)
    """On the ground, metres."""
    height: Annotated[Range, between(0.1, 4.0)] = (0.4, 0.9)
    """Above the ground, metres."""


def plan_blobs(
    feature: Rock | Boulder, spots: Spots, ground: Ground, generator: np.random.Generator
) -> Plan:
    """Draw the heights of rocks or boulders on their spots."""
    height = draw(feature.height, len(spots), generator)
    fineness = 1 if isinstance(feature, Rock) else 2
    foot = np.column_stack([spots.start, ground.height(*spots.start.T)])
    strength = height if isinstance(feature, Rock) else 0.0
    obstacles = spots.obstacles(feature.effect, feature.material, strength)
    triangles = len(spots) * 8 * 4**fineness
    make = partial(_make, foot, spots.radius, height, fineness, generator)
    return Plan(obstacles, triangles, make)


def _make(
    foot: Floats, radius: Floats, height: Floats, fineness: int, generator: np.random.Generator
) -> Iterator[Mesh]:
    corners, faces = ball(fineness)
    corners[:, 2] = np.copysign(np.abs(corners[:, 2]) ** FLATNESS, corners[:, 2])
    dents = 1 - generator.uniform(0.0, DENT, (len(foot), len(corners), 1))
    # The topmost corner and the sides keep the height and the radius of the obstacle.
    dents[:, :6] = 1.0
    size = np.column_stack([radius, radius, height])
    turned = _about_z(corners, generator.uniform(0.0, 2 * np.pi, len(foot)))
    points = turned * dents * size[:, None] + foot[:, None]
    first = np.uint32(len(corners)) * np.arange(len(foot), dtype=np.uint32)[:, None, None]
    yield mesh_of(points.reshape(-1, 3), (first + faces).reshape(-1, 3), "rock")


def _about_z(points: Floats, angles: Floats) -> Floats:
    cosine, sine = np.cos(angles)[:, None], np.sin(angles)[:, None]
    x, y, z = points.T
    flat = [cosine * x - sine * y, sine * x + cosine * y, np.broadcast_to(z, (len(angles), len(z)))]
    return np.stack(flat, axis=-1)
