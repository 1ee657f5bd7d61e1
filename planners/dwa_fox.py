"""The dynamic window approach of Fox, Burgard and Thrun (1997), GrASPE equation (9)."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from pydantic import Field

from graspe_data.manifest import Settings
from graspe_data.robot import Robot
from planners.arc_distance import admissible, free_way
from planners.body_discs import BodySettings, body_discs
from planners.fox_objective import FoxWeights, fox_objective
from planners.goal import goal_in_base, heading_error
from planners.obstacles import ObstacleSource
from planners.situation import Command, Considered, Situation
from planners.turning import TurnSettings, turns_on_the_spot
from planners.velocity_window import VelocityWindowSettings, velocity_window


class FoxSettings(Settings):
    """The window, the objective and the robot's shape."""

    window: VelocityWindowSettings = VelocityWindowSettings()
    weights: FoxWeights = FoxWeights()
    turn: TurnSettings = TurnSettings()
    body: BodySettings = BodySettings()
    reaction_s: Annotated[float, Field(ge=0)] = 0.2
    """Time between a command and its effect, as admissible velocities take it into account."""


class DwaFox:
    """Chooses among the admissible velocities by the smoothed objective."""

    def __init__(
        self, robot: Robot, obstacles: ObstacleSource, settings: FoxSettings | None = None
    ) -> None:
        """Take the robot and what finds its obstacles."""
        self._limits = robot.limits
        self._obstacles = obstacles
        self._settings = settings or FoxSettings()
        self._body = body_discs(robot.footprint, self._settings.body)

    def command(self, situation: Situation) -> Command:
        """The best of V_s, V_d and V_a; with none left, a free rotation on the spot, or a stop.

        Raises:
            PlannerError: There is no cloud.
        """
        settings, limits = self._settings, self._limits
        points, goal = self._obstacles.points(situation), goal_in_base(situation)
        window = velocity_window(limits, situation.velocity, settings.window)
        if not self._obstacles.sees_behind:
            window = window.keep(window.velocities[:, 0] > 0)
        way = free_way(window.velocities, points, self._body)
        quality = fox_objective(
            window, way, goal, limits, settings.window.interval_s, settings.weights
        )
        admitted = np.flatnonzero(admissible(window.velocities, way, limits, settings.reaction_s))
        velocities, quality = window.velocities[admitted], quality[admitted]
        if len(admitted) == 0:
            return self._turn(situation, Considered(velocities, quality, None, None))
        best = int(np.argmax(quality))
        v, omega = velocities[best].tolist()
        return Command(v, omega, considered=Considered(velocities, quality, None, best))

    def _turn(self, situation: Situation, considered: Considered) -> Command:
        points, goal = self._obstacles.points(situation), goal_in_base(situation)
        error = float(heading_error(np.zeros(3), goal))
        turns = turns_on_the_spot(
            self._limits, situation.velocity[1], error, points, self._settings.turn
        )
        free = admissible(turns, free_way(turns, points, self._body), self._limits)
        for _, omega in turns[free].tolist():
            reason = "no admissible velocity within reach: turning on the spot"
            return Command(0.0, omega, reason, considered)
        return Command(0.0, 0.0, "no admissible velocity and no room to turn: stop", considered)
