"""Uneven ground."""

from __future__ import annotations

import math
from typing import Annotated, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from graspe_data.arrays import Floats
from graspe_data.manifest import Settings
from graspe_data.simulation.world.feature import Region
from graspe_data.simulation.world.materials import MATERIAL_NAMES
from graspe_data.simulation.world.mesh import Mesh, mesh_of
from graspe_data.simulation.world.world import Ground

STEEPEST = math.tan(math.radians(15.0))
MARGIN = 15.0
FADE = 6.0
SKIRT = 120.0
WAVES = 32


class GroundSettings(Settings):
    """The ground: its cover and how uneven it is."""

    cover: Literal["soil", "short_grass", "gravel", "floor"] = "short_grass"
    """Its material."""
    amplitude: Annotated[float, Field(ge=0, le=0.3)] = 0.1
    """Height in metres of the highest point above, or the lowest below, z = 0."""
    wavelength: Annotated[float, Field(ge=0.5, le=100)] = 6.0
    """Metres from hill to hill."""
    cell: Annotated[float, Field(ge=0.1, le=2)] = 0.25
    """Metres between two heights."""

    @model_validator(mode="after")
    def _walkable(self) -> Self:
        least = 2 * math.pi * self.amplitude / STEEPEST
        if self.wavelength < least:
            raise ValueError(
                f"an amplitude of {self.amplitude:g} m is steeper than 15 degrees at a wavelength "
                f"of {self.wavelength:g} m: expected at least {least:.1f} m, or a lower amplitude"
            )
        if self.wavelength < 4 * self.cell and self.amplitude > 0:
            raise ValueError(
                f"a wavelength of {self.wavelength:g} m needs a cell of at most a quarter of it, "
                f"found {self.cell:g} m"
            )
        return self


def make_ground(settings: GroundSettings, arena: Region, generator: np.random.Generator) -> Ground:
    """Smooth random heights over the arena and 15 m around it, falling to 0 at the edge.

    A sum of plane waves of random direction and phase with wavelengths around the one given,
    scaled so that the amplitude, and a slope of 15 degrees, is nowhere exceeded.
    """
    counts = [math.ceil((arena[k + 2] - arena[k] + 2 * MARGIN) / settings.cell) for k in (0, 1)]
    spans = [count * settings.cell for count in counts]
    origin = tuple((arena[k] + arena[k + 2] - spans[k]) / 2 for k in (0, 1))
    x, y = (origin[k] + settings.cell * np.arange(counts[k] + 1.0) for k in (0, 1))
    heights = _waves(x, y, settings.wavelength, generator)
    heights *= np.minimum(_fade(y)[:, None], _fade(x)[None, :])
    return Ground(_scaled(heights, settings), (origin[0], origin[1]), settings.cell)


def ground_mesh(ground: Ground, settings: GroundSettings) -> Mesh:
    """The surface of the ground, and a flat skirt out to 120 m around it."""
    rows, columns = ground.heights.shape
    span = [(columns - 1) * ground.cell, (rows - 1) * ground.cell]
    x, y = (_with_skirt(ground.origin[k], span[k], ground.cell) for k in (0, 1))
    grid = np.zeros((len(y), len(x), 3))
    grid[..., 0], grid[..., 1] = x[None, :], y[:, None]
    grid[1:-1, 1:-1, 2] = ground.heights
    mesh = mesh_of(grid.reshape(-1, 3), _grid_faces(len(y), len(x)), settings.cover)
    if ground.bare is not None:
        bare = np.repeat(np.pad(ground.bare, 1).ravel(), 2)
        mesh.material[bare] = MATERIAL_NAMES.index("ditch")
    return mesh


def _waves(x: Floats, y: Floats, wavelength: float, generator: np.random.Generator) -> Floats:
    length = wavelength * generator.uniform(0.7, 1.8, WAVES)
    heading = generator.uniform(0, 2 * math.pi, WAVES)
    phase = generator.uniform(0, 2 * math.pi, WAVES)
    number = 2 * math.pi / length
    # cos(a + b + c) summed over the waves is one product of matrices, Re(e^ib e^ic . e^ia);
    # einsum sums in one order on every processor.
    along_x = np.exp(1j * np.outer(number * np.cos(heading), x))
    along_y = np.exp(1j * (np.outer(number * np.sin(heading), y) + phase[:, None]))
    summed: Floats = np.einsum("kr,kc->rc", length[:, None] * along_y, along_x).real
    return summed


def _fade(axis: Floats) -> Floats:
    inwards = np.clip(np.minimum(axis - axis[0], axis[-1] - axis) / FADE, 0.0, 1.0)
    smooth: Floats = inwards * inwards * (3 - 2 * inwards)
    return smooth


def _scaled(heights: Floats, settings: GroundSettings) -> Floats:
    rise = np.hypot(*np.gradient(heights, settings.cell)).max()
    scale = min(settings.amplitude / np.abs(heights).max(), STEEPEST / rise)
    scaled: Floats = heights * scale
    return scaled


def _with_skirt(origin: float, span: float, cell: float) -> Floats:
    inner = origin + np.arange(round(span / cell) + 1) * cell
    return np.concatenate([[origin - SKIRT], inner, [origin + span + SKIRT]])


def _grid_faces(rows: int, columns: int) -> np.ndarray[tuple[int, int], np.dtype[np.uint32]]:
    corner = np.arange(rows * columns, dtype=np.uint32).reshape(rows, columns)
    a, b, c, d = corner[:-1, :-1], corner[:-1, 1:], corner[1:, 1:], corner[1:, :-1]
    halves = np.stack([np.stack([a, b, c], -1), np.stack([a, c, d], -1)], axis=2)
    faces: np.ndarray[tuple[int, int], np.dtype[np.uint32]] = halves.reshape(-1, 3)
    return faces
