"""What deceives a lidar on the way of its beams: dust or rain, and leaves right before it.

Both act on beams: where each points, and how far off it met something. What comes in its way
returns in the place of what lies behind. What happens to a beam follows from the seed and from
where it points, whichever other beams there are.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from graspe_data.arrays import Mask

Beams = NDArray[np.float32]

PUFFS = 9
PUFF_DISTANCE, PUFF_DEPTH = (1.0, 4.5), (0.2, 0.6)
"""Metres, of the middle of a puff of dust and of its standard deviation along a beam."""
PUFF_WIDTH, PUFF_HEIGHT = (0.2, 0.6), (0.08, 0.25)
"""rad, standard deviations in azimuth and elevation; its middle lies a little below level."""
PUFF_ELEVATION = (-0.2, 0.05)
DUST_BRIGHTNESS = 0.08
"""Share of its own intensity that a beam returns from dust, at the median."""
LEAF_DISTANCE = (0.46, 0.62)
"""Metres."""
LEAF_RADIUS = (0.05, 0.12)
"""rad: leaves of 5 to 13 cm half a metre off."""
LEAF_AZIMUTH, LEAF_ELEVATION = np.pi / 2, 0.3
"""rad to either side, where they hang: before the robot."""
LEAF_TILT = 0.04
"""Standard deviation of the distance on one leaf, as a share."""
MOST_LEAVES = 600
GRID = 1000.0
"""Cells to a radian, in which beams that point alike share their chances."""
_STEP, _WORD = 0x9E3779B97F4A7C15, 1 << 64


@dataclass(frozen=True)
class Dust:
    """Puffs of dust, or rain; ``strength`` 0..1: how dense a puff is in its middle."""

    strength: float
    seed: int = 0

    def __post_init__(self) -> None:
        """Refuse a strength that is none."""
        _share(self.strength, "strength of dust")


@dataclass(frozen=True)
class NearLeaves:
    """Leaves half a metre before the lidar; ``share`` 0..1: of what is ahead that they hide."""

    share: float
    seed: int = 0

    def __post_init__(self) -> None:
        """Refuse a share that is none."""
        _share(self.share, "share of the view behind leaves")


@dataclass(frozen=True)
class MetReturns:
    """What beams return, (N,) each.

    ``met``: whether something came in the way. ``distance``: metres. ``brightness``: by how much
    the intensity changes, 1 where nothing came. ``roughness``: relative standard deviation of the
    distances among neighbouring returns there, 0 where nothing came.
    """

    met: Mask
    distance: Beams
    brightness: Beams
    roughness: Beams


def _share(value: float, name: str) -> None:
    if not 0.0 <= value <= 1.0:
        raise ValueError(f"{name}: {value:g} is not in 0..1")


def meet_dust(direction: Beams, distance: Beams, dust: Dust) -> MetReturns:
    """Beams through puffs of dust: some return from there.

    Args:
        direction: Of each beam, float32 (N, 3), of any length above 0; z up.
        distance: Metres to what it met without dust, float32 (N,); inf where nothing.
        dust: How dense, and where.
    """
    drawn = np.random.default_rng([dust.seed, 21])
    azimuth, elevation = _angles(direction)
    chances = _Chances(azimuth, elevation, dust.seed)
    nearest = np.asarray(distance, np.float32).copy()
    rough = np.zeros(len(nearest), np.float32)
    for _ in range(PUFFS):
        middle, low = drawn.uniform(-np.pi, np.pi), drawn.uniform(*PUFF_ELEVATION)
        width, height = drawn.uniform(*PUFF_WIDTH), drawn.uniform(*PUFF_HEIGHT)
        place, depth = drawn.uniform(*PUFF_DISTANCE), drawn.uniform(*PUFF_DEPTH)
        # A beam meets dust the likelier, the nearer it passes to the middle of the puff.
        off = _turn(azimuth - np.float32(middle)) / np.float32(width)
        up = (elevation - np.float32(low)) / np.float32(height)
        chance = np.float32(dust.strength) * np.exp(-(off * off + up * up) / 2)
        meets = chances.uniform() < chance
        where = np.float32(place) + np.float32(depth) * chances.normal()
        hit = meets & (where > LEAF_DISTANCE[0]) & (where < nearest)
        nearest[hit] = where[hit]
        rough[hit] = np.float32(depth / place)
    met = rough > 0
    faint = np.float32(DUST_BRIGHTNESS) * np.exp(np.float32(0.5) * chances.normal())
    brightness = np.where(met, np.minimum(faint, 1), np.float32(1)).astype(np.float32)
    return MetReturns(met, nearest, brightness, rough)


def meet_leaves(direction: Beams, distance: Beams, leaves: NearLeaves) -> MetReturns:
    """Beams that meet leaves half a metre off, in ragged discs ahead of the sensor.

    Args:
        direction: Of each beam, float32 (N, 3), of any length above 0; x ahead, z up.
        distance: Metres to what it met without leaves, float32 (N,); inf where nothing.
        leaves: How many, and where.
    """
    drawn = np.random.default_rng([leaves.seed, 22])
    azimuth, elevation = _angles(direction)
    number = len(distance)
    nearest = np.asarray(distance, np.float32).copy()
    met = np.zeros(number, np.bool_)
    for middle, height, radius, place in _leaves(leaves, drawn):
        off, up = _turn(azimuth - np.float32(middle)), elevation - np.float32(height)
        disc = off * off + up * up < np.float32(radius * radius)
        tilt = np.float32(place) * (1 + np.float32(LEAF_TILT) * off / np.float32(radius))
        hit = disc & (tilt < nearest)
        nearest[hit] = tilt[hit]
        met |= hit
    rough = np.where(met, np.float32(LEAF_TILT), np.float32(0))
    return MetReturns(met, nearest, np.ones(number, np.float32), rough)


def _leaves(leaves: NearLeaves, drawn: np.random.Generator) -> list[tuple[float, ...]]:
    """Azimuth, elevation and radius in rad and distance in metres of each leaf.

    Leaves are added until they hide the share asked for of a grid over what is ahead.
    """
    grid = np.meshgrid(
        np.linspace(-LEAF_AZIMUTH, LEAF_AZIMUTH, 90),
        np.linspace(-LEAF_ELEVATION, LEAF_ELEVATION, 18),
    )
    hidden = np.zeros(grid[0].shape, np.bool_)
    found: list[tuple[float, ...]] = []
    while leaves.share > 0 and hidden.mean() < leaves.share and len(found) < MOST_LEAVES:
        middle = drawn.uniform(-LEAF_AZIMUTH, LEAF_AZIMUTH)
        height = drawn.uniform(-LEAF_ELEVATION, LEAF_ELEVATION)
        radius, place = drawn.uniform(*LEAF_RADIUS), drawn.uniform(*LEAF_DISTANCE)
        hidden |= (grid[0] - middle) ** 2 + (grid[1] - height) ** 2 < radius**2
        found.append((middle, height, radius, place))
    return found


def _angles(direction: Beams) -> tuple[Beams, Beams]:
    """Azimuth and elevation, rad, (N,) each."""
    x, y, z = np.asarray(direction, np.float32).T
    return np.arctan2(y, x), np.arctan2(z, np.hypot(x, y))


class _Chances:
    """Numbers by chance for beams, each from where it points and the seed alone."""

    def __init__(self, azimuth: Beams, elevation: Beams, seed: int) -> None:
        """Number the beams by the cell of a fine grid that they point to."""
        column = np.floor((azimuth + np.float32(np.pi)) * np.float32(GRID)).astype(np.uint64)
        row = np.floor((elevation + np.float32(np.pi)) * np.float32(GRID)).astype(np.uint64)
        self._cell = (column << np.uint64(32)) + row + np.uint64(seed * _STEP % _WORD)
        self._calls = 0

    def uniform(self) -> Beams:
        """Within 0 and 1; others at each call. The mixing is that of splitmix64."""
        self._calls += 1
        mixed = self._cell + np.uint64(self._calls * _STEP % _WORD)
        mixed = (mixed ^ (mixed >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
        mixed = (mixed ^ (mixed >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
        mixed ^= mixed >> np.uint64(31)
        chance: Beams = (mixed >> np.uint64(40)).astype(np.float32) / np.float32(1 << 24)
        return chance

    def normal(self) -> Beams:
        """Of mean 0 and deviation 1, by Box and Muller."""
        away = np.sqrt(-2 * np.log1p(-self.uniform()))
        number: Beams = away * np.cos(np.float32(2 * np.pi) * self.uniform())
        return number


def _turn(angle: Beams) -> Beams:
    """The same angle within -pi and pi."""
    turn = np.float32(2 * np.pi)
    within: Beams = angle - turn * np.rint(angle / turn)
    return within
