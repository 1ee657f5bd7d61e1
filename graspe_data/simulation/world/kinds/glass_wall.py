"""Walls of glass."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field

from graspe_data.arrays import Floats
from graspe_data.simulation.world.feature import LineFeature, Range, between, draw
from graspe_data.simulation.world.materials import Effect, MaterialName
from graspe_data.simulation.world.mesh import Mesh, mesh_of
from graspe_data.simulation.world.plan import Plan, Spots
from graspe_data.simulation.world.shapes.beams import BEAM_TRIANGLES, beams
from graspe_data.simulation.world.shapes.lines import line_lengths, line_levels, part_of_lines
from graspe_data.simulation.world.world import Ground

SUNK = 0.2
THICKNESS = 0.02


class GlassWall(LineFeature):
    """A pane, one sheet, that stops; with posts between its fields where a frame is asked for."""

    kind: Literal["glass_wall"] = "glass_wall"
    effect: ClassVar[Effect] = "stops"
    material: ClassVar[MaterialName] = "glass"

    height: Annotated[Range, between(0.3, 20.0)] = (2.2, 2.8)
    """Above the highest ground under it, metres."""
    frame_every: Annotated[float, Field(ge=0.5, le=20)] | None = 2.5
    """Metres from post to post; None leaves the posts out."""
    frame_width: Annotated[float, Field(ge=0.01, le=0.5)] = 0.05
    """Of the posts, metres."""

    @property
    def half_thickness(self) -> float:
        """Half the thickness in metres."""
        return THICKNESS / 2


def plan_glass_walls(
    feature: GlassWall, spots: Spots, ground: Ground, generator: np.random.Generator
) -> Plan:
    """Draw the heights of panes on their lines."""
    height = draw(feature.height, len(spots), generator)
    posts = _posts(feature, spots)
    obstacles = spots.obstacles("stops", "glass")
    triangles = 2 * len(spots) + BEAM_TRIANGLES * len(posts[0])
    return Plan(obstacles, triangles, partial(_make, feature, spots, posts, height, ground))


def _posts(feature: GlassWall, spots: Spots) -> tuple[Floats, Floats]:
    """Which wall each post belongs to (P,), and its distance (P,) from the wall's start."""
    if feature.frame_every is None:
        return np.empty(0), np.empty(0)
    lengths = line_lengths(spots)
    counts = np.maximum(np.rint(lengths / feature.frame_every), 1).astype(int) + 1
    half = feature.frame_width / 2
    ways = [
        np.linspace(min(half, length / 2), max(length - half, length / 2), count)
        for length, count in zip(lengths, counts, strict=True)
    ]
    owners = np.repeat(np.arange(len(spots)), counts).astype(np.float64)
    return owners, np.concatenate([np.empty(0), *ways])


def _make(
    feature: GlassWall,
    spots: Spots,
    posts: tuple[Floats, Floats],
    height: Floats,
    ground: Ground,
) -> Iterator[Mesh]:
    low, high = line_levels(spots, ground)
    bottom, top = low - SUNK, high + height
    ends = [spots.start, spots.end, spots.end, spots.start]
    levels = [bottom, bottom, top, top]
    corners = [np.column_stack([end, z]) for end, z in zip(ends, levels, strict=True)]
    first = 4 * np.arange(len(spots), dtype=np.uint32)[:, None, None]
    faces = first + np.array([[0, 1, 2], [0, 2, 3]], np.uint32)
    yield mesh_of(np.stack(corners, axis=1).reshape(-1, 3), faces.reshape(-1, 3), "glass")
    owner = posts[0].astype(np.intp)
    walls = Spots(spots.start[owner], spots.end[owner], spots.radius[owner])
    half = feature.frame_width / 2
    post = part_of_lines(walls, posts[1] - half, posts[1] + half)
    start, end = (np.column_stack([end, bottom[owner]]) for end in (post.start, post.end))
    yield beams(start, end, feature.frame_width, (top - bottom)[owner], "pillar")
