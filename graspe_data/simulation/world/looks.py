"""What the materials of one world look like: as listed, or drawn apart from what they do."""

from __future__ import annotations

from dataclasses import replace
from typing import Literal

import numpy as np

from graspe_data.simulation.world.materials import FLAT, MATERIALS, Material, MaterialName

Looks = Literal["typical", "decoupled"]

FOLIAGE: tuple[MaterialName, ...] = (
    "short_grass",
    "grass",
    "leaf",
    "hanging_leaf",
    "bush",
    "vine",
    "litter",
)
DULL: tuple[MaterialName, ...] = (
    "soil",
    "gravel",
    "floor",
    "ceiling",
    "bark",
    "rock",
    "wood",
    "concrete",
    "pillar",
    "bead",
    "paint",
)
REFLECTIVITY = (0.35, 0.9)
CONTRAST = (0.25, 0.6)
TRANSLUCENCY = (0.1, 0.35)
GREEN = (0.07, 0.22)
"""Albedo of foliage in green, evenly by its logarithm; red and blue as shares of it below."""
RED_SHARE, BLUE_SHARE = (0.4, 0.95), (0.2, 0.35)
BRIGHT = (0.08, 0.5)
"""Albedo of what is dull in red, evenly by its logarithm; green as a share of it then blue."""
DULL_SHARE = (0.65, 1.0)

Table = dict[MaterialName, Material]


def draw_looks(looks: Looks, cover: MaterialName, generator: np.random.Generator) -> Table:
    """The materials of a world.

    ``typical``: as ``MATERIALS`` has them, where what is solid reflects the lidar strongly and
    bushes are darker than grass. ``decoupled``: colours, contrasts and reflectivities of all plants
    are drawn from one distribution, and those of all that is dull (bark, rock, walls, soil, paint)
    from another, with one for the reflectivities of both, whatever a thing does to a robot. Mud,
    water, ditches and glass keep their colours: nothing else tells them.

    In both, what lies flat returns as much of a beam as the ground that it lies on.

    Args:
        looks: Which.
        cover: Of the ground.
        generator: Draws.
    """
    drawn = dict(MATERIALS)
    if looks == "decoupled":
        drawn |= {name: _plant(MATERIALS[name], generator) for name in FOLIAGE}
        drawn |= {name: _dull(MATERIALS[name], generator) for name in DULL}
    under = drawn[cover].reflectivity
    return drawn | {name: replace(drawn[name], reflectivity=under) for name in FLAT}


def _plant(own: Material, generator: np.random.Generator) -> Material:
    green = float(np.exp(generator.uniform(*np.log(GREEN))))
    red, blue = (green * float(generator.uniform(*share)) for share in (RED_SHARE, BLUE_SHARE))
    through = float(generator.uniform(*TRANSLUCENCY))
    changed = _drawn(own, (red, green, blue), generator)
    return replace(changed, translucency=through) if own.translucency else changed


def _dull(own: Material, generator: np.random.Generator) -> Material:
    red = float(np.exp(generator.uniform(*np.log(BRIGHT))))
    green = red * float(generator.uniform(*DULL_SHARE))
    return _drawn(own, (red, green, green * float(generator.uniform(*DULL_SHARE))), generator)


def _drawn(
    own: Material, colour: tuple[float, float, float], generator: np.random.Generator
) -> Material:
    contrast, reflectivity = (float(generator.uniform(*span)) for span in (CONTRAST, REFLECTIVITY))
    return replace(own, colour=colour, contrast=contrast, reflectivity=reflectivity)
