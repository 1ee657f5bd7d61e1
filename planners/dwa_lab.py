"""The dynamic window approach as the groups behind GrASPE run it: a cost minimiser."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from pydantic import Field

from graspe_data.arrays import Floats
from graspe_data.manifest import Settings
from graspe_data.observation.trajectory import constant_velocity_arc
from graspe_data.robot import Robot
from planners.goal import goal_in_base, heading_error
from planners.obstacles import ObstacleSource
from planners.situation import Command, Considered, Situation
from planners.turning import TurnSettings, turns_on_the_spot
from planners.velocity_window import VelocityWindowSettings, velocity_window

Weight = Annotated[float, Field(ge=0)]


class LabSettings(Settings):
    """Gains, roll-out and radius; the defaults are those of the groups' code for Spot."""

    window: VelocityWindowSettings = VelocityWindowSettings()
    turn: TurnSettings = TurnSettings()
    to_goal: Weight = 5.0
    """Of the distance in metres from the roll-out's end to the goal."""
    speed: Weight = 0.1
    """Of the m/s that are missing to the fastest velocity."""
    obstacle: Weight = 3.2
    """Of one over the least distance in metres to an obstacle."""
    predict_s: Annotated[float, Field(gt=0, le=30)] = 2.0
    """Length of the roll-out; the groups use 2.0 to 3.5 s."""
    step_s: Annotated[float, Field(ge=0.01, le=1)] = 0.1
    """Time between its poses."""
    radius: Annotated[float, Field(gt=0)] | None = None
    """Of the robot, metres: nearer is a collision; None takes the footprint's corner (Spot: .6)."""
    farthest: Annotated[float, Field(gt=0)] = 6.0
    """Obstacles beyond this many metres do not count."""


class DwaLab:
    """Chooses the roll-out of the least cost; those that collide cost infinitely much.

    Unlike Fox's it knows no admissible velocities, no normalisation and no smoothing. Source:
    kasunweerkoon/local-planner-dwa (form of the cost), the groups' settings for Spot (gains).
    """

    def __init__(
        self, robot: Robot, obstacles: ObstacleSource, settings: LabSettings | None = None
    ) -> None:
        """Take the robot and what finds its obstacles."""
        self._limits = robot.limits
        self._obstacles = obstacles
        self._settings = settings or LabSettings()
        corner = float(np.hypot(robot.footprint.length, robot.footprint.width)) / 2
        self._radius = self._settings.radius or corner

    def command(self, situation: Situation) -> Command:
        """The cheapest velocity; where all collide, a rotation on the spot.

        Raises:
            PlannerError: There is no cloud.
        """
        points = self._obstacles.points(situation)
        points = points[np.hypot(*points.T) <= self._settings.farthest]
        velocities = velocity_window(
            self._limits, situation.velocity, self._settings.window
        ).velocities
        if not self._obstacles.sees_behind:
            velocities = velocities[velocities[:, 0] > 0]
        cost = self._cost(velocities, points, goal_in_base(situation))
        if not np.isfinite(cost).any():
            return self._turn(situation, points, Considered(velocities, -cost, None, None))
        best = int(np.nanargmin(cost))
        v, omega = velocities[best].tolist()
        return Command(v, omega, considered=Considered(velocities, -cost, None, best))

    def _cost(self, velocities: Floats, points: Floats, goal: Floats) -> Floats:
        settings = self._settings
        steps = max(1, round(settings.predict_s / settings.step_s))
        v, omega = velocities.T
        paths = constant_velocity_arc(v, omega, steps, settings.step_s)[..., :2]
        to_goal = np.linalg.norm(goal - paths[:, -1], axis=1)
        slower = self._limits.linear_velocity[1] - v
        nearest = _nearest(paths, points)
        obstacle = np.where(nearest <= self._radius, np.inf, 1.0 / np.maximum(nearest, 1e-9))
        cost: Floats = settings.to_goal * to_goal + settings.speed * slower
        return cost + (settings.obstacle * obstacle if settings.obstacle else 0.0)

    def _turn(self, situation: Situation, points: Floats, considered: Considered) -> Command:
        error = float(heading_error(np.zeros(3), goal_in_base(situation)))
        turns = turns_on_the_spot(
            self._limits, situation.velocity[1], error, points, self._settings.turn
        )
        room = not len(points) or float(np.hypot(*points.T).min()) > self._radius
        for _, omega in turns.tolist() if room else ():
            reason = "all roll-outs collide: turning on the spot"
            return Command(0.0, omega, reason, considered)
        return Command(
            0.0, 0.0, "all roll-outs collide, and there is no room to turn: stop", considered
        )


def _nearest(paths: Floats, points: Floats) -> Floats:
    """Least distance (K,) between paths (K, S, 2) and points (N, 2); inf without points."""
    nearest = np.full(len(paths), np.inf)
    square = np.sum(points**2, axis=1)
    for row, path in enumerate(paths) if len(points) else ():
        apart = np.sum(path**2, axis=1)[:, None] - 2 * path @ points.T + square
        nearest[row] = np.sqrt(max(float(apart.min()), 0.0))
    return nearest
