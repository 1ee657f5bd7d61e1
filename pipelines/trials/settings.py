"""How a trial is run, and when it is over."""

from __future__ import annotations

from typing import Annotated, Self

from pydantic import Field, model_validator

from graspe_data.manifest import Settings
from graspe_data.simulation.motion.drive import STEP_S

Seconds = Annotated[float, Field(gt=0, le=36_000)]


class TrialSettings(Settings):
    """How a trial is run, and when it is over."""

    goal_radius: Annotated[float, Field(gt=0, le=10)] = 0.6
    """Metres from the goal to base_link, by odometry, at which the robot has arrived."""
    time_limit_s: Annotated[float, Field(ge=1, le=36_000)] = 90.0
    """Seconds after which a trial has failed."""
    control_period_s: Annotated[float, Field(ge=STEP_S, le=10)] = 0.1
    """Seconds that a command is held."""
    sensor_rate: Annotated[float, Field(ge=0.01, le=20)] | None = None
    """Hz, of camera and lidar; None is the scenario's."""
    stuck_s: Seconds = 3.0
    """Seconds that the robot may be held by something before the trial has failed."""
    stalled_s: Seconds = 15.0
    """Seconds without getting on by ``stalled_m`` after which a trial has failed."""
    stalled_m: Annotated[float, Field(gt=0, le=10)] = 0.5
    """Metres."""
    arena_margin: Annotated[float, Field(ge=0, le=100)] = 1.0
    """Metres beyond the arena's edge at which a robot has left it and the trial has failed."""
    history_s: Seconds = 6.0
    """Seconds of odometry that planners are given."""

    @property
    def control_steps(self) -> int:
        """Steps of the simulation that a command is held."""
        return round(self.control_period_s / STEP_S)

    @model_validator(mode="after")
    def _on_steps(self) -> Self:
        if abs(self.control_period_s / STEP_S - self.control_steps) > 1e-6:  # noqa: PLR2004
            raise ValueError(
                f"control_period_s: {self.control_period_s:g} s is no whole number of the "
                f"simulation's steps of {STEP_S:g} s"
            )
        return self
