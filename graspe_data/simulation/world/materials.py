"""What surfaces are made of: how they look, reflect a lidar, and act on a robot."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

Effect = Literal["free", "slows", "stumbles", "entangles", "stops"]
MaterialName = Literal[
    "soil",
    "short_grass",
    "gravel",
    "floor",
    "ceiling",
    "grass",
    "leaf",
    "hanging_leaf",
    "bush",
    "bark",
    "vine",
    "rock",
    "wood",
    "concrete",
    "pillar",
    "glass",
    "bead",
    "mud",
    "water",
    "ditch",
    "litter",
    "paint",
]


@dataclass(frozen=True)
class Material:
    """A surface.

    ``colour``: diffuse albedo, linear RGB in 0..1. ``contrast``: how far a texture of ``grain``
    metres varies it, 0..1. ``translucency``: the share of light that passes a leaf to its shaded
    side. ``reflectivity``: of a lidar beam that hits squarely, as a share of the sensor's maximum.
    ``transmission``: the share of a beam, or of light, that goes straight through (glass).
    ``gloss``: how much of the sky it mirrors, as a share of what still water does.
    """

    colour: tuple[float, float, float]
    contrast: float
    grain: float
    reflectivity: float
    effect: Effect
    translucency: float = 0.0
    transmission: float = 0.0
    gloss: float = 0.0


MATERIALS: dict[MaterialName, Material] = {
    "soil": Material((0.17, 0.12, 0.07), 0.5, 0.25, 0.45, "free"),
    "short_grass": Material((0.10, 0.17, 0.04), 0.6, 0.12, 0.40, "free"),
    "gravel": Material((0.27, 0.26, 0.24), 0.7, 0.06, 0.50, "free"),
    "floor": Material((0.42, 0.40, 0.37), 0.15, 0.60, 0.55, "free"),
    "ceiling": Material((0.70, 0.70, 0.68), 0.05, 0.60, 0.75, "free"),
    "grass": Material((0.19, 0.22, 0.05), 0.35, 0.30, 0.35, "slows", translucency=0.35),
    "leaf": Material((0.05, 0.13, 0.03), 0.35, 0.20, 0.50, "free", translucency=0.25),
    "hanging_leaf": Material((0.08, 0.19, 0.04), 0.35, 0.20, 0.45, "free", translucency=0.30),
    "bush": Material((0.03, 0.08, 0.025), 0.45, 0.15, 0.80, "entangles", translucency=0.15),
    "bark": Material((0.11, 0.07, 0.045), 0.6, 0.08, 0.85, "stops"),
    "vine": Material((0.07, 0.10, 0.03), 0.3, 0.10, 0.60, "entangles", translucency=0.1),
    "rock": Material((0.28, 0.27, 0.25), 0.5, 0.12, 0.80, "stumbles"),
    "wood": Material((0.30, 0.20, 0.11), 0.4, 0.10, 0.85, "stops"),
    "concrete": Material((0.40, 0.39, 0.37), 0.25, 0.35, 0.90, "stops"),
    "pillar": Material((0.55, 0.53, 0.50), 0.15, 0.35, 0.92, "stops"),
    "glass": Material((0.50, 0.55, 0.55), 0.0, 1.0, 0.45, "stops", transmission=0.86),
    "bead": Material((0.45, 0.30, 0.35), 0.5, 0.04, 0.45, "free"),
    "mud": Material((0.06, 0.042, 0.028), 0.35, 0.30, 0.45, "entangles", gloss=0.25),
    "water": Material((0.035, 0.04, 0.03), 0.1, 0.60, 0.45, "entangles", gloss=1.0),
    "ditch": Material((0.12, 0.085, 0.05), 0.6, 0.15, 0.45, "entangles"),
    "litter": Material((0.15, 0.09, 0.04), 0.45, 0.08, 0.45, "free"),
    "paint": Material((0.55, 0.55, 0.52), 0.15, 0.20, 0.45, "free"),
}

FLAT: tuple[MaterialName, ...] = ("mud", "water", "ditch", "litter", "paint")
"""What lies on the ground and returns a beam as the ground does: a lidar cannot tell it."""

MATERIAL_NAMES: tuple[MaterialName, ...] = tuple(MATERIALS)
"""A surface's material is stored as the index into this."""
