"""Where things stand, and the plan of one feature before its surfaces are made."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np

from graspe_data.arrays import Floats
from graspe_data.simulation.world.materials import Effect, MaterialName
from graspe_data.simulation.world.mesh import Mesh
from graspe_data.simulation.world.obstacles import Obstacle


@dataclass(frozen=True)
class Spots:
    """N capsules on the ground on which things stand; metres, world frame.

    ``start``, ``end`` float64 (N, 2), the same for round things; ``radius`` (N,).
    """

    start: Floats
    end: Floats
    radius: Floats

    def __len__(self) -> int:
        """How many."""
        return len(self.radius)

    def obstacles(
        self, effect: Effect, material: MaterialName, strength: Floats | float = 0.0
    ) -> tuple[Obstacle, ...]:
        """One obstacle on each spot, of a strength each or for all."""
        strengths = np.broadcast_to(strength, len(self)).tolist()
        ends = zip(self.start.tolist(), self.end.tolist(), strict=True)
        return tuple(
            Obstacle((a[0], a[1]), (b[0], b[1]), radius, effect, material, value)
            for (a, b), radius, value in zip(ends, self.radius.tolist(), strengths, strict=True)
        )


NOWHERE = Spots(np.empty((0, 2)), np.empty((0, 2)), np.empty(0))


@dataclass(frozen=True)
class Plan:
    """A feature, drawn but not yet made: obstacles, number of triangles, and how to make them."""

    obstacles: tuple[Obstacle, ...]
    triangles: int
    make: Callable[[], Iterable[Mesh]]
