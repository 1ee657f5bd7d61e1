"""Rocks under the feet: which ones throw the robot off its gait, and for how long."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from graspe_data.arrays import Floats
from graspe_data.simulation.motion.drive import STEP_S
from graspe_data.simulation.motion.mechanics import STUMBLES, MechanicsSettings, stumble_chance
from graspe_data.simulation.motion.surroundings import Surroundings

FORGET = 0.3


@dataclass(frozen=True)
class Stumble:
    """A stumble from a step on: ``tilt`` in rad, toward ``direction`` in rad from forward."""

    step: int
    tilt: float
    direction: float


class Stumbling:
    """Remembers the rocks that the robot has met, so that each is drawn for once."""

    def __init__(self, settings: MechanicsSettings, generator: np.random.Generator) -> None:
        """Start on firm ground."""
        self._settings = settings
        self._generator = generator
        self._met: set[int] = set()
        self.stumbles: list[Stumble] = []

    def phase(self, step: int) -> float:
        """How far the current stumble is, 0..1; 1 where there is none."""
        if not self.stumbles:
            return 1.0
        elapsed = (step - self.stumbles[-1].step) * STEP_S
        return min(1.0, elapsed / self._settings.stumble_s)

    def share(self, step: int) -> float:
        """The share of the commanded speed that the current stumble leaves."""
        dip = float(np.sin(np.pi * self.phase(step))) ** 2
        return 1.0 - (1.0 - self._settings.stumble_share) * dip

    def tread(self, step: int, around: Surroundings, gaps: Floats, speed: float) -> None:
        """Draw for the rocks that come under the footprint at this step."""
        rocks = around.near.effect == STUMBLES
        left = around.index[rocks & (gaps > FORGET)]
        self._met.difference_update(left.tolist())
        for place in np.flatnonzero(rocks & (gaps < 0)).tolist():
            rock = int(around.index[place])
            if rock not in self._met:
                self._met.add(rock)
                self._draw(step, float(around.near.strength[place]), speed)

    def _draw(self, step: int, height: float, speed: float) -> None:
        chance, direction = self._generator.random(), self._generator.uniform(-np.pi, np.pi)
        if chance < stumble_chance(height, speed, self._settings) and self.phase(step) >= 1.0:
            tilt = min(height * self._settings.stumble_tilt, self._settings.largest_tilt)
            self.stumbles.append(Stumble(step, tilt, float(direction)))


def stumble_tilts(stumbles: Sequence[Stumble], lasting_s: float, time_s: Floats) -> Floats:
    """Roll and pitch (N, 2) in rad at times (N,): the body tips over and back, as sin^2."""
    tilts = np.zeros((len(time_s), 2))
    for stumble in stumbles:
        phase = np.clip((time_s - stumble.step * STEP_S) / lasting_s, 0.0, 1.0)
        tip = stumble.tilt * np.sin(np.pi * phase) ** 2
        tilts += tip[:, None] * (np.sin(stumble.direction), np.cos(stumble.direction))
    return tilts


def stumbling_at(stumbles: Sequence[Stumble], lasting_s: float, steps: int) -> NDArray[np.bool_]:
    """Whether the robot is off its gait at each step, bool (steps,)."""
    stumbling: NDArray[np.bool_] = np.zeros(steps, np.bool_)
    for stumble in stumbles:
        stumbling[stumble.step : stumble.step + round(lasting_s / STEP_S)] = True
    return stumbling
