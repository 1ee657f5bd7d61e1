"""Settings of the randomised planner."""

from __future__ import annotations

from typing import Annotated, Self

from pydantic import Field, model_validator

from graspe_data.manifest import Settings, Share

Positive = Annotated[float, Field(gt=0, le=1000)]
Range = tuple[Positive, Positive]
Spell = Annotated[float, Field(gt=0, le=60)]
Spells = tuple[Spell, Spell]
TurnRate = Annotated[float, Field(ge=0.05, le=10)]


class PlannerSettings(Settings):
    """How the randomised planner draws its commands."""

    speed: Range = (0.35, 0.6)
    """m/s, kept within the robot's limits."""
    hold_s: Spells = (1.5, 4.0)
    """Seconds that a command is held."""
    yaw_spread: Annotated[float, Field(ge=0, le=5)] = 0.25
    """rad/s, standard deviation of the yaw rate about the one toward the waypoint."""
    caution: Share = 0.9
    """Chance that a command is looked at in the world before it is taken."""
    curiosity: Share = 0.7
    """Chance that a waypoint lies on something that could hold the robot; nothing is looked at on
    the way there. The waypoint after a failure is none of these, and every command is looked at."""
    curious_reach: Positive = 9.0
    """Metres to such a waypoint at most."""
    outlook_s: Spell = 3.5
    """Seconds ahead that are looked at, at least; and until a second after the command ends."""
    tries: Annotated[int, Field(ge=1, le=100)] = 12
    """Commands drawn to find a good one; a cautious robot that finds none turns on the spot."""
    berth: Annotated[float, Field(ge=0, le=1)] = 0.05
    """Metres that a cautious robot keeps from what it sees."""
    push_s: Spells = (1.5, 3.5)
    """Seconds that a held robot goes on pushing, as one that does not know."""
    back_speed: Range = (0.3, 0.4)
    """m/s, backwards; the recovery may go backwards whatever the robot's limits."""
    back_s: Spells = (1.0, 2.5)
    """Seconds of going backwards."""
    turn_rate: tuple[TurnRate, TurnRate] = (0.4, 0.6)
    """rad/s, of turns on the spot."""
    stand: Share = 0.04
    """Chance that a draw is standing still."""
    turn: Share = 0.05
    """Chance that it is a turn on the spot."""
    oscillate: Share = 0.01
    """Chance that it is turning to and fro on the spot."""
    margin: Annotated[float, Field(ge=0, le=10)] = 0.8
    """Metres between base_link and the edge of the arena."""

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        for name in ("speed", "hold_s", "push_s", "back_speed", "back_s", "turn_rate"):
            low, high = getattr(self, name)
            if low > high:
                raise ValueError(f"{name}: the lower limit {low} is above the upper limit {high}")
        return self
