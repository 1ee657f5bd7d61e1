"""The beams of a turning VLP-16: when and where it fires, as a few rays each, and its points."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Final

import numpy as np
from numpy.typing import NDArray

from graspe_data.geometry import Transform

RINGS: Final = 16
LASER_S: Final = 2.304e-6
"""Seconds between two lasers of a column."""
COLUMN_S: Final = 55.296e-6
"""Seconds between two columns."""


@dataclass(frozen=True)
class Firings:
    """The N firings of a turn in their order: columns outside, the 16 lasers inside.

    ``time_s`` float64 (N,), from the first firing on. ``azimuth`` float64 (N,), rad, falling from
    pi: the sensor turns clockwise, and its cut is behind. ``direction`` float64 (N, 3), unit, of
    the beam's axis in the sensor's frame. ``ring`` uint16 (N,), from the lowest beam up.
    """

    time_s: NDArray[np.float64]
    azimuth: NDArray[np.float64]
    direction: NDArray[np.float64]
    ring: NDArray[np.uint16]

    def where(self, kept: NDArray[np.bool_] | slice) -> Firings:
        """Those kept, bool (N,) or a slice."""
        return Firings(self.time_s[kept], self.azimuth[kept], self.direction[kept], self.ring[kept])


def firings_of_turn(rotation_rate: float) -> Firings:
    """All whole columns of one turn; ``rotation_rate`` in Hz.

    A column takes 55.296 us (VLP-16 user manual 63-9243, figure 9-7), so there are 1808 at 10 Hz,
    and each laser has the azimuth of its own time, as the driver computes it.
    """
    columns = int(1.0 / (rotation_rate * COLUMN_S))
    lasers = np.arange(RINGS)
    time_s = (np.arange(columns)[:, None] * COLUMN_S + lasers * LASER_S).ravel()
    azimuth = np.pi - 2 * np.pi * rotation_rate * time_s
    # The lasers of the lower and of the upper half fire by turns: -15, 1, -13, 3, ...
    ring = np.tile(lasers // 2 + (lasers % 2) * (RINGS // 2), columns).astype(np.uint16)
    elevation = np.radians(2.0 * ring - 15.0)
    level = np.cos(elevation)
    direction = np.stack(
        [level * np.cos(azimuth), level * np.sin(azimuth), np.sin(elevation)], axis=1
    )
    return Firings(time_s, azimuth, direction, ring)


_LEAST_WITH_CENTRE: Final = 5
_GOLDEN_ANGLE: Final = np.pi * (3.0 - np.sqrt(5.0))


def sub_rays(directions: NDArray[np.float64], divergence: float, count: int) -> NDArray[np.float32]:
    """Spread beams into rays of equal weight.

    The rays lie on a ring, from five on with one in the middle, whose mean square radius is that
    of an evenly lit disc, R^2 / 2 with R = divergence / 2. The ring is turned from beam to beam.

    Args:
        directions: (N, 3), unit, of the beams' axes; none is vertical.
        divergence: Full angle of the cone, rad.
        count: Rays in a beam.

    Returns:
        float32 (N, count, 3), unit.
    """
    across, along = _pattern(len(directions), count)
    aside = np.stack(
        [-directions[:, 1], directions[:, 0], np.zeros(len(directions))], axis=1
    ) / np.hypot(directions[:, :1], directions[:, 1:2])
    upward = np.cross(directions, aside)
    half = divergence / 2
    rays = directions[:, None] + half * (
        across[..., None] * aside[:, None] + along[..., None] * upward[:, None]
    )
    rays /= np.linalg.norm(rays, axis=2, keepdims=True)
    return rays.astype(np.float32)


def _pattern(beams: int, count: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Offsets in a disc of radius 1, each (beams, count)."""
    if count == 1:
        return np.zeros((beams, 1)), np.zeros((beams, 1))
    ringed = count if count < _LEAST_WITH_CENTRE else count - 1
    radius = np.zeros(count)
    radius[count - ringed :] = np.sqrt(count / (2 * ringed))
    angle = np.arange(count) * (2 * np.pi / ringed) + _GOLDEN_ANGLE * np.arange(beams)[:, None]
    return radius * np.cos(angle), radius * np.sin(angle)


Floats32 = NDArray[np.float32]


def moving_rays(
    rays: Floats32, knot: NDArray[np.float64], poses: Sequence[Transform]
) -> tuple[Floats32, Floats32]:
    """Carry rays into the world, each from where the sensor is when it is sent.

    Between poses both translation and rotation matrix are blended linearly; over an angle of
    delta rad this shortens a direction by no more than delta^2 / 8.

    Args:
        rays: (N, K, 3), in the sensor's frame, in order of time.
        knot: (N,), rising, when each is sent: 2.5 is halfway between the poses 2 and 3.
        poses: The sensor in the world at the knots 0, 1, ...

    Returns:
        Origins and directions, each (N K, 3).
    """
    # Which two poses each ray is sent between.
    pairs = list(pairwise(poses)) or [(poses[0], poses[0])]
    interval = np.clip(knot.astype(np.intp), 0, len(pairs) - 1)
    bounds = np.searchsorted(interval, np.arange(len(pairs) + 1))
    origins, directions = np.empty_like(rays), np.empty_like(rays)
    for index, (first, last) in enumerate(pairs):
        rows = slice(bounds[index], bounds[index + 1])
        # Origin and rotation blended linearly between them.
        share = (knot[rows, None, None] - index).astype(np.float32)
        moved = (last.translation - first.translation).astype(np.float32)
        origins[rows] = first.translation + share * moved
        directions[rows] = _turned(rays[rows], first.rotation)
        directions[rows] += share * _turned(rays[rows], last.rotation - first.rotation)
    return origins.reshape(-1, 3), directions.reshape(-1, 3)


def _turned(rays: Floats32, rotation: NDArray[np.float64]) -> Floats32:
    # einsum sums in one order, whatever the number of threads.
    turned: Floats32 = np.einsum("nkj,ij->nki", rays, rotation.astype(np.float32))
    return turned


POINT_TYPE: Final[np.dtype[np.void]] = np.dtype(
    {
        "names": ["x", "y", "z", "intensity", "ring", "time"],
        "formats": ["<f4", "<f4", "<f4", "<f4", "<u2", "<f4"],
        "offsets": [0, 4, 8, 12, 16, 18],
        "itemsize": 22,
    }
)
"""As the velodyne_pointcloud driver publishes it: metres in the sensor's frame, 0..255, the
ring from the lowest beam up, and seconds since the cloud's stamp."""
