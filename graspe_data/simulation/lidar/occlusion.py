"""Mud or a leaf on the lidar's window, or dirt all over it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from graspe_data.sensor_failures import Dust, NearLeaves


@dataclass(frozen=True)
class SectorOcclusion:
    """A sector that returns nothing: counter-clockwise from ``start`` to ``stop``, rad.

    Azimuths of the sensor's frame, 0 ahead; ``stop`` is above ``start`` by at most a full turn.
    """

    start: float
    stop: float

    def __post_init__(self) -> None:
        """Refuse a sector of no width, or wider than a turn."""
        if not 0 < self.stop - self.start <= 2 * np.pi + 1e-9:
            raise ValueError(
                f"sector from {self.start:g} to {self.stop:g} rad: expected a width above 0 and "
                f"at most 2 pi, found {self.stop - self.start:g}; stop counts on from start"
            )

    def covers(self, azimuth: NDArray[np.floating]) -> NDArray[np.bool_]:
        """Whether azimuths in rad lie in the sector; any shape."""
        inside: NDArray[np.bool_] = (azimuth - self.start) % (2 * np.pi) < self.stop - self.start
        return inside


@dataclass(frozen=True)
class ThinnedReturns:
    """A dirty window: returns are lost here and there.

    ``share``: of the returns that are lost, 0..1. ``seed``: of which.
    """

    share: float
    seed: int = 0

    def __post_init__(self) -> None:
        """Refuse a share that is none."""
        if not 0.0 <= self.share <= 1.0:
            raise ValueError(f"share of the returns that are lost: {self.share:g} is not in 0..1")


BeforeLidar = SectorOcclusion | ThinnedReturns | Dust | NearLeaves
"""What may be on a lidar's window or right before it."""
