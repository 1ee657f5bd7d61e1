"""What the ground and contact do to a robot: slip, hits, and the speed that plants leave."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from pydantic import Field

from graspe_data.arrays import Floats
from graspe_data.manifest import Settings, Share
from graspe_data.simulation.world.obstacles import EFFECTS, Obstacles


class SlipSettings(Settings):
    """How much slips, and how slowly that changes."""

    mean: Annotated[float, Field(ge=0, le=0.5)] = 0.04
    """Share of the speed."""
    spread: Annotated[float, Field(ge=0, le=0.3)] = 0.02
    """Standard deviation of the share; it stays within 0 and 0.6."""
    change_s: Annotated[float, Field(ge=0.1, le=600)] = 4.0
    """Seconds from one independent value to the next, between which it goes in a straight line."""


def slip_shares(settings: SlipSettings, time_s: Floats, generator: np.random.Generator) -> Floats:
    """The share of the speed lost at each time, float64 (N,)."""
    knots = np.arange(0.0, time_s[-1] + 2 * settings.change_s, settings.change_s)
    drawn = generator.normal(settings.mean, settings.spread, len(knots))
    return np.interp(time_s, knots, np.clip(drawn, 0.0, 0.6))


Small = Annotated[float, Field(gt=0, le=10)]


class MechanicsSettings(Settings):
    """How contact acts."""

    rebound: Annotated[float, Field(ge=0, le=0.25)] = 0.06
    """Share of the speed that a solid thing throws back."""
    rebound_speed: Small = 0.1
    """m/s; a slower contact stops the robot without a rebound."""
    leaving_share: Annotated[float, Field(ge=0.2, le=1)] = 0.4
    """Of the commanded speed, the least that is left on the way out of what entangles."""
    entangled_share: Annotated[float, Field(gt=0, lt=1)] = 0.2
    """Of the commanded speed; with less left, the robot counts as held."""
    stumble_height: Small = 0.05
    """Metres of rock and m/s of speed at which a stumble has a chance of 1 - 1/e; the chance is
    1 - exp(-height / stumble_height * speed / stumble_speed)."""
    stumble_speed: Small = 0.3
    """m/s."""
    stumble_s: Annotated[float, Field(gt=0, le=2)] = 0.4
    """Seconds that a stumble lasts."""
    stumble_share: Share = 0.5
    """Of the commanded speed, left in the middle of a stumble."""
    stumble_tilt: Small = 2.0
    """rad of tilt for each metre of the rock's height, at most ``largest_tilt``."""
    largest_tilt: Annotated[float, Field(gt=0, le=0.6)] = 0.3
    """rad."""


@dataclass(frozen=True)
class Grip:
    """What vegetation does to a robot in it.

    ``slowed``: share of the speed left by what slows. ``load``: depth over strength, of what
    entangles the most; 0 where nothing does.
    """

    slowed: float
    load: float

    @property
    def held_share(self) -> float:
        """The share of the speed that entanglement leaves: exp(-depth / strength)."""
        return float(np.exp(-self.load))


FREE = Grip(1.0, 0.0)
SLOWS, ENTANGLES, STUMBLES, STOPS = (
    EFFECTS.index(name) for name in ("slows", "entangles", "stumbles", "stops")
)


def grip_of(obstacles: Obstacles, gaps: Floats) -> Grip:
    """The grip of N obstacles at signed distances (N,) in metres; several count as the worst."""
    touching = gaps < 0
    slows = touching & (obstacles.effect == SLOWS)
    holds = touching & (obstacles.effect == ENTANGLES)
    slowed = float(obstacles.strength[slows].min()) if slows.any() else 1.0
    if not holds.any():
        return Grip(slowed, 0.0)
    depth = -gaps[holds] / np.maximum(obstacles.strength[holds], 1e-6)
    return Grip(slowed, float(depth.max()))


def stumble_chance(height: float, speed: float, settings: MechanicsSettings) -> float:
    """How likely a rock of a height in metres throws a robot of a speed in m/s off its gait."""
    load = height / settings.stumble_height * speed / settings.stumble_speed
    return float(-np.expm1(-load))
