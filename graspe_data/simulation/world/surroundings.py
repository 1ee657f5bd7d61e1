"""What a thing that is about to be placed has to keep away from."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from graspe_data.arrays import Floats
from graspe_data.simulation.world.capsules import capsule_gaps
from graspe_data.simulation.world.feature import Feature
from graspe_data.simulation.world.materials import MATERIALS, Effect
from graspe_data.simulation.world.plan import Spots
from graspe_data.simulation.world.settings import WorldSettings

HINDERING: tuple[Effect, ...] = ("stumbles", "entangles", "stops")
SOLID: tuple[Effect, ...] = ("entangles", "stops")


@dataclass(frozen=True)
class Surroundings:
    """A world so far: its settings, the solid things in it, and the feature that is next."""

    settings: WorldSettings
    solid: Spots
    feature: Feature
    where: str
    """The feature's key, for errors."""

    @property
    def effect(self) -> Effect:
        """What the feature does to a robot in this world, after changes to its material."""
        feature = self.feature
        change = self.settings.materials.get(feature.material)
        own = feature.effect == MATERIALS[feature.material].effect
        return change.effect if own and change and change.effect else feature.effect

    @property
    def keeps_clear(self) -> bool:
        """Whether the feature keeps its clearance to what is solid."""
        return self.effect in SOLID and not self.feature.intertwined

    def gaps_to_start(self, spots: Spots) -> Floats:
        """Metres (N,) from the start."""
        place = np.array([self.settings.start[:2]])
        gaps: Floats = capsule_gaps(spots, Spots(place, place, np.zeros(1)))[:, 0]
        return gaps

    def hinders_start(self, spots: Spots) -> np.ndarray[tuple[int]]:
        """Which spots (N,) lie too near to the start for what the feature does."""
        near: np.ndarray[tuple[int]] = self.gaps_to_start(spots) < self.settings.start_clearance
        return near & (self.effect in HINDERING)
