"""What closes the view: a ceiling above, trees far around."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from graspe_data.arrays import Floats
from graspe_data.manifest import Settings
from graspe_data.simulation.world.feature import Range, Region, between
from graspe_data.simulation.world.kinds.volumes import leaf_counts
from graspe_data.simulation.world.mesh import Mesh, mesh_of
from graspe_data.simulation.world.plan import Plan
from graspe_data.simulation.world.shapes.leaves import LEAF_TRIANGLES, leaf_area, leaves

LEAF_LENGTH, LEAF_WIDTH = 0.7, 0.5
DEPTH = 5.0
COLUMN = 0.6
QUARTER = 16


class Ceiling(Settings):
    """A flat ceiling over the whole arena."""

    kind: Literal["ceiling"] = "ceiling"

    height: Annotated[float, Field(ge=1.0, le=30)] = 3.0
    """Above z = 0, metres."""


class Treeline(Settings):
    """Trees all around, out of the robot's reach, so that there is a horizon."""

    kind: Literal["treeline"] = "treeline"

    distance: Annotated[float, Field(ge=16, le=80)] = 28.0
    """From the arena's edge, metres."""
    height: Annotated[Range, between(0.5, 25.0)] = (4.0, 9.0)
    """Lowest and highest treetops, metres."""
    leaf_area_density: Annotated[float, Field(ge=0, le=2)] = 0.35
    """m2 of leaf, one side, per m3."""


def plan_ceiling(feature: Ceiling, arena: Region) -> Plan:
    """One square over the arena."""
    x, y = (arena[0], arena[2]), (arena[1], arena[3])
    flat = [(x[0], y[0]), (x[1], y[0]), (x[1], y[1]), (x[0], y[1])]
    corners = np.array([(*corner, feature.height) for corner in flat])
    faces = np.array([[0, 2, 1], [0, 3, 2]])
    return Plan((), len(faces), lambda: [mesh_of(corners, faces, "ceiling")])


def plan_treeline(feature: Treeline, arena: Region, generator: np.random.Generator) -> Plan:
    """Big leaves in a jagged belt before a jagged, dark strip."""
    belt = _ring(arena, feature.distance)
    length = np.linalg.norm(np.diff(belt, axis=0), axis=1).sum()
    columns = int(length / COLUMN)
    tops = _treetops(feature.height, columns, generator)
    volume = length * DEPTH * tops.mean()
    density = np.array([feature.leaf_area_density])
    count = leaf_counts(density, np.array([volume]), leaf_area(LEAF_LENGTH, LEAF_WIDTH))
    triangles = 2 * columns + LEAF_TRIANGLES * int(count[0])
    make = partial(_make, feature, arena, tops, int(count[0]), generator)
    return Plan((), triangles, make)


def _make(
    feature: Treeline, arena: Region, tops: Floats, count: int, generator: np.random.Generator
) -> Iterator[Mesh]:
    yield _strip(_ring(arena, feature.distance + DEPTH), tops, generator)
    # Columns are drawn in proportion to their height, so that the density is even.
    share = (tops + np.roll(tops, -1)).cumsum()
    column = np.searchsorted(share / share[-1], generator.random(count))
    column = np.minimum(column, len(tops) - 1)
    along = (column + generator.random(count)) / len(tops)
    inner, outer = (_on_ring(_ring(arena, feature.distance + way), along) for way in (0, DEPTH))
    depth = generator.random(count)[:, None]
    top = np.interp(along * len(tops), np.arange(len(tops) + 1), np.append(tops, tops[0]))
    height = top * generator.random(count)
    centres = np.column_stack([inner * (1 - depth) + outer * depth, height])
    yield leaves(centres, LEAF_LENGTH, LEAF_WIDTH, "leaf", generator)


def _strip(ring: Floats, tops: Floats, generator: np.random.Generator) -> Mesh:
    columns = len(tops)
    base = _on_ring(ring, np.arange(columns) / columns)
    jagged = 0.9 * tops * generator.uniform(0.85, 1.0, columns)
    corners = np.concatenate(
        [np.column_stack([base, np.full(columns, -0.5)]), np.column_stack([base, jagged])]
    )
    here = np.arange(columns)
    beside = np.roll(here, -1)
    lower = np.column_stack([here, beside, beside + columns])
    upper = np.column_stack([here, beside + columns, here + columns])
    return mesh_of(corners, np.concatenate([lower, upper]), "leaf")


def _treetops(height: Range, columns: int, generator: np.random.Generator) -> Floats:
    """Heights (columns,) of overlapping round treetops, all around."""
    trees = max(columns // 5, 3)
    middle = generator.uniform(0, columns, trees)
    tall = generator.uniform(*height, trees)
    away = np.abs(np.arange(columns)[:, None] - middle)
    away = np.minimum(away, columns - away) * COLUMN
    domes = tall * np.sqrt(np.maximum(1 - (away / (0.45 * tall)) ** 2, 0.0))
    tops: Floats = np.maximum(domes.max(axis=1), 0.6 * height[0])
    return tops


def _ring(arena: Region, distance: float) -> Floats:
    """A closed line (K, 2) at a distance from a rectangle: straight sides and round corners."""
    angle = np.linspace(0, np.pi / 2, QUARTER) + np.arange(4)[:, None] * np.pi / 2
    x = np.array([arena[2], arena[0], arena[0], arena[2]])[:, None] + distance * np.cos(angle)
    y = np.array([arena[3], arena[3], arena[1], arena[1]])[:, None] + distance * np.sin(angle)
    points = np.column_stack([x.ravel(), y.ravel()])
    return np.concatenate([points, points[:1]])


def _on_ring(ring: Floats, share: Floats) -> Floats:
    """Points (N, 2) at shares 0..1 of the way around."""
    steps = np.linalg.norm(np.diff(ring, axis=0), axis=1)
    way = np.concatenate([[0.0], steps.cumsum()]) / steps.sum()
    return np.column_stack([np.interp(share, way, axis) for axis in ring.T])
