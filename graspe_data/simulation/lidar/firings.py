"""When and where to a VLP-16 fires."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

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
