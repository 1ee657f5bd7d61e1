"""A small analytic world: uneven light on a textured ground, trunks, walls and patches of grass."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

SKY, GROUND, TRUNK, WALL, GRASS = range(5)
FAR = 1e9
PRIMES = np.array(
    [0x9E3779B185EBCA87, 0xC2B2AE3D27D4EB4F, 0x165667B19E3779F9, 0x27D4EB2F165667C5], np.uint64
)


@dataclass(frozen=True)
class Trunk:
    """An upright cylinder on the ground; metres."""

    x: float
    y: float
    radius: float
    height: float


@dataclass(frozen=True)
class Block:
    """A box on the ground, parallel to the axes; metres. ``grass`` lets some rays through."""

    x: tuple[float, float]
    y: tuple[float, float]
    height: float
    grass: bool = False


@dataclass(frozen=True)
class World:
    """What stands on the plane z = 0."""

    trunks: tuple[Trunk, ...] = ()
    blocks: tuple[Block, ...] = ()
    density: float = 2.5
    """Of grass: mean number of blades that a ray meets in a metre."""


@dataclass(frozen=True)
class Hits:
    """Where rays end: distance along the ray in metres (inf: sky), and what is there."""

    distance: Floats
    material: NDArray[np.uint8]


def cast_rays(
    world: World, origin: Floats, directions: Floats, generator: np.random.Generator
) -> Hits:
    """Follow rays to the first surface.

    In grass a ray ends after an exponentially distributed depth (Beer-Lambert), or goes through.

    Args:
        world: What is there.
        origin: (3,), metres, above the ground.
        directions: Unit vectors (N, 3).
        generator: Draws the depths in grass.
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        down = np.where(directions[:, 2] < 0, -origin[2] / directions[:, 2], FAR)
        distance, material = down, np.where(down < FAR, GROUND, SKY).astype(np.uint8)
        for trunk in world.trunks:
            _nearer(distance, material, _to_trunk(trunk, origin, directions), TRUNK)
        for block in world.blocks:
            enter, leave = _through_block(block, origin, directions)
            if block.grass:
                depth = generator.exponential(1 / world.density, len(directions))
                enter = np.where(enter + depth < leave, enter + depth, FAR)
            _nearer(distance, material, enter, GRASS if block.grass else WALL)
    distance[material == SKY] = np.inf
    return Hits(distance, material)


def surface_noise(points: Floats, scales: tuple[float, ...]) -> Floats:
    """A repeatable grey texture in 0..1 at points (N, 3): hashed cells of several sizes, metres."""
    total = np.zeros(len(points))
    for scale in scales:
        x, y, z = np.floor(points / scale).astype(np.int64).T.view(np.uint64)
        mixed = (x * PRIMES[0]) ^ (y * PRIMES[1]) ^ (z * PRIMES[2])
        mixed = (mixed ^ (mixed >> np.uint64(29))) * PRIMES[3]
        total += ((mixed >> np.uint64(32)) & np.uint64(255)) / 255.0
    return total / len(scales)


def _nearer(distance: Floats, material: NDArray[np.uint8], other: Floats, what: int) -> None:
    closer = other < distance
    distance[closer] = other[closer]
    material[closer] = what


def _to_trunk(trunk: Trunk, origin: Floats, directions: Floats) -> Floats:
    offset = origin[:2] - (trunk.x, trunk.y)
    flat = directions[:, :2]
    a = (flat**2).sum(axis=1)
    b = flat @ offset
    root = b**2 - a * (offset @ offset - trunk.radius**2)
    reach = (-b - np.sqrt(np.where(root > 0, root, np.nan))) / a
    height = origin[2] + reach * directions[:, 2]
    standing = (reach > 0) & (height >= 0) & (height <= trunk.height)
    return np.where(standing, reach, FAR)


def _through_block(block: Block, origin: Floats, directions: Floats) -> tuple[Floats, Floats]:
    low = np.array([block.x[0], block.y[0], 0.0])
    high = np.array([block.x[1], block.y[1], block.height])
    near, far = (low - origin) / directions, (high - origin) / directions
    enter = np.minimum(near, far).max(axis=1)
    leave = np.maximum(near, far).min(axis=1)
    met = (enter < leave) & (leave > 0)
    return np.where(met, np.maximum(enter, 0.0), FAR), np.where(met, leave, -FAR)
