"""Curtains of beads or strings."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from typing import Annotated, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

from graspe_data.arrays import Floats
from graspe_data.simulation.world.feature import LineFeature, Range, between, draw
from graspe_data.simulation.world.materials import Effect, MaterialName
from graspe_data.simulation.world.mesh import Mesh, mesh_of
from graspe_data.simulation.world.plan import Plan, Spots
from graspe_data.simulation.world.shapes.balls import octahedron
from graspe_data.simulation.world.shapes.beams import BEAM_TRIANGLES, beams
from graspe_data.simulation.world.shapes.lines import line_lengths, line_levels, part_of_lines
from graspe_data.simulation.world.shapes.tubes import tubes
from graspe_data.simulation.world.world import Ground

BEAD_HEIGHT, BEAD_RADIUS = 0.03, 0.009
STRING_RADIUS, STRING_SIDES = 0.003, 3
ROD = 0.04


class Curtain(LineFeature):
    """Strands that hang from a rod and give way."""

    kind: Literal["curtain"] = "curtain"
    effect: ClassVar[Effect] = "free"
    material: ClassVar[MaterialName] = "bead"

    strands: Literal["beads", "strings"] = "beads"
    """What hangs there."""
    spacing: Annotated[Range, between(0.01, 1.0)] = (0.03, 0.06)
    """Between strands, metres."""
    top: Annotated[Range, between(0.5, 5.0)] = (2.1, 2.1)
    """Height in metres of the rod."""
    bottom: Annotated[Range, between(0.0, 2.0)] = (0.03, 0.15)
    """Height in metres to which the strands hang; at most 0.2 below the rod."""

    @property
    def half_thickness(self) -> float:
        """Half the thickness in metres."""
        return ROD / 2


def plan_curtains(
    feature: Curtain, spots: Spots, ground: Ground, generator: np.random.Generator
) -> Plan:
    """Draw the strands of curtains on their lines."""
    spans = feature.spacing, feature.top, feature.bottom
    spacing, top, bottom = (draw(span, len(spots), generator) for span in spans)
    bottom = np.minimum(bottom, top - 0.2)
    count = np.maximum(line_lengths(spots) / spacing, 1).astype(np.int64)
    beads = np.maximum((top - bottom) / BEAD_HEIGHT, 1).astype(np.int64)
    strand = 8 * beads if feature.strands == "beads" else np.full(len(spots), 2 * STRING_SIDES)
    triangles = BEAM_TRIANGLES * len(spots) + int((count * strand).sum())
    make = partial(_make, feature, spots, count, top, bottom, ground)
    return Plan(spots.obstacles("free", "bead"), triangles, make)


def _make(
    feature: Curtain,
    spots: Spots,
    count: NDArray[np.int64],
    top: Floats,
    bottom: Floats,
    ground: Ground,
) -> Iterator[Mesh]:
    level = line_levels(spots, ground)[1]
    start, end = (np.column_stack([end, level + top]) for end in (spots.start, spots.end))
    yield beams(start, end, ROD, ROD, "wood")
    owner = np.repeat(np.arange(len(spots)), count)
    number = np.arange(len(owner)) - np.repeat(np.cumsum(count) - count, count)
    walls = Spots(spots.start[owner], spots.end[owner], spots.radius[owner])
    way = (number + 0.5) / count[owner] * line_lengths(walls)
    place = part_of_lines(walls, way, way).start
    strand = _beads if feature.strands == "beads" else _strings
    yield strand(place, (level + top)[owner], (level + bottom)[owner])


def _strings(place: Floats, top: Floats, bottom: Floats) -> Mesh:
    paths = np.stack([np.column_stack([place, z]) for z in (bottom, top)], axis=1)
    return tubes(paths, np.full((len(place), 2), STRING_RADIUS), STRING_SIDES, "bead")


def _beads(place: Floats, top: Floats, bottom: Floats) -> Mesh:
    count = np.maximum((top - bottom) / BEAD_HEIGHT, 1).astype(np.int64)
    owner = np.repeat(np.arange(len(place)), count)
    number = np.arange(len(owner)) - np.repeat(np.cumsum(count) - count, count)
    centre = np.column_stack([place[owner], top[owner] - (number + 0.5) * BEAD_HEIGHT])
    corners, faces = octahedron()
    corners = corners * [BEAD_RADIUS, BEAD_RADIUS, BEAD_HEIGHT / 2]
    first = np.uint32(len(corners)) * np.arange(len(centre), dtype=np.uint32)[:, None, None]
    points = centre[:, None] + corners
    return mesh_of(points.reshape(-1, 3), (first + faces).reshape(-1, 3), "bead")
