"""Footprints on the ground that act on a robot that touches them."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from graspe_data.arrays import Floats
from graspe_data.simulation.world.materials import Effect, MaterialName

EFFECTS: tuple[Effect, ...] = ("free", "slows", "stumbles", "entangles", "stops")


@dataclass(frozen=True)
class Obstacle:
    """A capsule on the ground: all points within ``radius`` of the segment; metres, world frame.

    A disc is a capsule whose ends meet. ``strength``: for ``slows`` the share of the speed that
    is left; for ``entangles`` the way in metres over which the speed falls to 1/e; for
    ``stumbles`` the height of the rock in metres; else 0.
    """

    start: tuple[float, float]
    end: tuple[float, float]
    radius: float
    effect: Effect
    material: MaterialName
    strength: float = 0.0


@dataclass(frozen=True)
class Obstacles:
    """N obstacles as arrays: ``start``, ``end`` (N, 2); ``radius``, ``strength`` (N,) float64.

    ``effect`` uint8 (N,), indices into ``EFFECTS``; ``material`` names each one.
    """

    start: Floats
    end: Floats
    radius: Floats
    strength: Floats
    effect: NDArray[np.uint8]
    material: tuple[MaterialName, ...]

    @classmethod
    def of(cls, obstacles: Iterable[Obstacle]) -> Obstacles:
        """Put obstacles into arrays, in the order given."""
        items = list(obstacles)
        return cls(
            np.array([item.start for item in items], np.float64).reshape(-1, 2),
            np.array([item.end for item in items], np.float64).reshape(-1, 2),
            np.array([item.radius for item in items], np.float64),
            np.array([item.strength for item in items], np.float64),
            np.array([EFFECTS.index(item.effect) for item in items], np.uint8),
            tuple(item.material for item in items),
        )

    def having(self, *effects: Effect) -> Obstacles:
        """Those with one of these effects."""
        wanted = np.isin(self.effect, [EFFECTS.index(effect) for effect in effects])
        return self.at(np.flatnonzero(wanted))

    def at(self, index: NDArray[np.intp]) -> Obstacles:
        """Those of these numbers, in that order."""
        return Obstacles(
            self.start[index],
            self.end[index],
            self.radius[index],
            self.strength[index],
            self.effect[index],
            tuple(self.material[number] for number in index.tolist()),
        )
