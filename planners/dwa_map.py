"""The dynamic window approach on a cost map: equation (12) of the multi-layer intensity map."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from pydantic import Field

from graspe_data.arrays import Floats
from graspe_data.manifest import Settings
from graspe_data.observation.trajectory import constant_velocity_arc
from graspe_data.robot import Robot
from planners.body_discs import BodySettings, body_discs
from planners.cost_map import CostMap, MapSource
from planners.goal import goal_in_base, goal_seen_from, heading_error
from planners.map_roll_outs import MapRollOuts
from planners.situation import Command, Considered, Situation
from planners.turning import TurnSettings, turns_on_the_spot
from planners.velocity_window import VelocityWindowSettings, velocity_window

Weight = Annotated[float, Field(ge=0)]

_CRAWLS = 3
"""Yaw rates to each side at which a way out is looked for."""


class MapDwaSettings(Settings):
    """Gains, roll-out and body; the gains but ``obstacle`` are those of the groups' for Spot."""

    window: VelocityWindowSettings = VelocityWindowSettings()
    turn: TurnSettings = TurnSettings()
    body: BodySettings = BodySettings(count=5, margin=0.0)
    """The discs that run over the map."""
    margin: Annotated[float, Field(ge=0)] = 0.1
    """Metres about them that roll-outs keep free: what cells, odometry and delays are off by."""
    berth: Annotated[float, Field(ge=0)] = 0.3
    """Metres about them whose cells count in equation (12)."""
    to_goal: Weight = 5.0
    """Of the distance in metres from the roll-out's end to the goal."""
    speed: Weight = 0.1
    """Of the m/s that are missing to the fastest velocity."""
    obstacle: Weight = 0.3
    """Of equation (12), in cells of cost 1 along the roll-out: at 1, posts beside a doorway cost
    more than the way through it is worth."""
    predict_s: Annotated[float, Field(gt=0, le=30)] = 3.0
    """Length of the roll-out; the groups use 3.0 to 3.5 s."""
    step_s: Annotated[float, Field(ge=0.01, le=1)] = 0.1
    """Time between its poses."""
    reaction_s: Annotated[float, Field(ge=0)] = 0.2
    """Time between a command and its effect, for the room that a turn or a crawl takes."""


class DwaMap:
    """Chooses the roll-out of the least cost among those that keep off barred cells.

    cost(v, w) = to_goal |goal - end| + speed (v_max - v) + obstacle obs(v, w). With none left it
    rotates on the spot or crawls on, where the body keeps clear of solid cells, or stops.
    """

    def __init__(
        self, robot: Robot, source: MapSource, settings: MapDwaSettings | None = None
    ) -> None:
        """Take the robot and what makes its maps."""
        self._limits, self._source = robot.limits, source
        self._settings = settings or MapDwaSettings()
        self._footprint = robot.footprint
        self._body = body_discs(robot.footprint, self._settings.body)

    def command(self, situation: Situation) -> Command:
        """The cheapest velocity whose roll-out is free; else a way out of here, or a stop.

        Raises:
            PlannerError: There is no cloud, or no map can be made of it.
        """
        settings, limits = self._settings, self._limits
        cost_map = self._source.cost_map(situation)
        ground = MapRollOuts(
            cost_map, situation.pose, self._footprint, self._body, settings.margin, settings.berth
        )
        window = velocity_window(limits, situation.velocity, settings.window).velocities
        steps = max(1, round(settings.predict_s / settings.step_s))
        velocities = window[ground.free(window, settings.predict_s, steps)]
        if len(velocities) == 0:
            return self._get_away(situation, cost_map, ground, _slowest(window))
        cost = self._cost(velocities, ground, goal_in_base(situation), steps)
        if not np.isfinite(cost).all():
            return Command(0.0, 0.0, "the cost of roll-outs is no number: stop")
        best = int(np.argmin(cost))
        v, omega = velocities[best].tolist()
        return Command(v, omega, considered=Considered(velocities, -cost, None, best))

    def _cost(self, velocities: Floats, ground: MapRollOuts, goal: Floats, steps: int) -> Floats:
        settings = self._settings
        v, omega = velocities.T
        ends = constant_velocity_arc(v, omega, 1, settings.predict_s)[:, 1, :2]
        # Equation (12): distance of the end to the goal, speed that is missing, obstacles under it.
        cost: Floats = settings.to_goal * np.linalg.norm(goal - ends, axis=1)
        cost += settings.speed * (self._limits.linear_velocity[1] - v)
        return cost + settings.obstacle * ground.cost(velocities, settings.predict_s, steps)

    def _get_away(
        self, situation: Situation, cost_map: CostMap, ground: MapRollOuts, slowest: float
    ) -> Command:
        """Turn as begun; where that is blocked, crawl; else turn the other way; else stop."""
        settings, limits = self._settings, self._limits
        error = float(heading_error(np.zeros(3), goal_in_base(situation)))
        points = _points_now(cost_map, situation)
        turns = turns_on_the_spot(limits, situation.velocity[1], error, points, settings.turn)
        rates = np.union1d(np.linspace(*limits.yaw_rate, 2 * _CRAWLS + 1), 0.0)
        rates = rates[: len(rates) if slowest else 0]
        crawls = np.stack((np.full(len(rates), slowest), rates), axis=1)
        preferred = turns[0, 1] if len(turns) else error
        to_that_side = np.argsort(-np.sign(preferred) * rates)
        moves = np.concatenate((turns[:1], crawls[to_that_side], turns[1:]))
        considered = Considered(np.empty((0, 2)), np.empty(0), None, None)
        for v, omega in moves[ground.room(moves, limits, settings.reaction_s)].tolist():
            what = "crawling on" if v else "turning on the spot"
            return Command(v, omega, f"all roll-outs meet barred cells: {what}", considered)
        return Command(0.0, 0.0, "all roll-outs meet barred cells: stop", considered)


def _slowest(window: Floats) -> float:
    """The slowest velocity ahead, m/s; where there is none, the slowest; 0 where there is none."""
    ahead = window[window[:, 0] > 0, 0]
    speeds = ahead if len(ahead) else window[:, 0]
    return float(speeds[np.argmin(np.abs(speeds))]) if len(speeds) else 0.0


def _points_now(cost_map: CostMap, situation: Situation) -> Floats:
    """Centres of the solid cells (N, 2), metres, in base_link now."""
    points, turn = cost_map.solid_points(), situation.pose[2] - cost_map.pose[2]
    away = points - goal_seen_from(cost_map.pose, situation.pose[:2])
    cosine, sine = np.cos(turn), np.sin(turn)
    return np.asarray(away @ np.array([[cosine, -sine], [sine, cosine]]))
