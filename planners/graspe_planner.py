"""GrASPE's planner: section IV-G, equations (8) and (9), and a model that accepts or rejects."""

from __future__ import annotations

from dataclasses import replace
from typing import Annotated

import numpy as np
from pydantic import Field

from graspe_data.arrays import Floats, Mask
from graspe_data.manifest import Settings
from graspe_data.robot import Robot
from planners.arc_distance import FreeWay, admissible, free_way
from planners.body_discs import BodySettings, body_discs
from planners.fox_objective import FoxWeights, fox_objective
from planners.goal import goal_in_base, heading_error
from planners.obstacles import scan_points
from planners.robot_check import check_robot
from planners.scorer import Scene, Scorer
from planners.situation import Command, Considered, Situation
from planners.turning import TurnSettings, turns_on_the_spot
from planners.velocity_window import (
    VelocityWindow,
    VelocityWindowSettings,
    stays_in_view,
    velocity_window,
    view_bearings,
)

Threshold = Annotated[float, Field(ge=0, le=1)]


class GraspePlannerSettings(Settings):
    """The window, the objective, the robot's shape; thresholds of None are the bundle's."""

    window: VelocityWindowSettings = VelocityWindowSettings()
    weights: FoxWeights = FoxWeights()
    turn: TurnSettings = TurnSettings()
    body: BodySettings = BodySettings()
    reaction_s: Annotated[float, Field(ge=0)] = 0.2
    """Time between a command and its effect, as admissible velocities take it into account."""
    acceptance: Threshold | None = None
    """e_th: a candidate is driven when the least of its probabilities reaches this."""
    reliability: Threshold | None = None
    """r_th of equation (8)."""


class GraspePlanner:
    """Drives the best velocity that the model accepts; any bundle can be the model.

    Where all of V_r are rejected the robot rotates on the spot, if equation (8) leaves that, and so
    looks for a way that is accepted. The model is not asked about rotations: what it was taught
    leads somewhere, and a robot that may neither drive nor look around stays for good.
    """

    needs_picture = True

    def __init__(
        self, robot: Robot, scorer: Scorer, settings: GraspePlannerSettings | None = None
    ) -> None:
        """Take the robot, and the scorer of a bundle that was made for it.

        Raises:
            PlannerError: The robot is not the bundle's; see ``check_robot``.
        """
        check_robot(scorer.contract, robot, scorer.calibration, scorer.match)
        self._scorer, self._limits = scorer, robot.limits
        self._settings = settings or GraspePlannerSettings()
        decision = scorer.contract.decision
        acceptance, reliability = self._settings.acceptance, self._settings.reliability
        self._e_th = decision.acceptance if acceptance is None else acceptance
        self._r_th = decision.reliability if reliability is None else reliability
        self._body = body_discs(robot.footprint, self._settings.body)
        self._bearings = view_bearings(scorer.camera, scorer.base_from_camera)

    def command(self, situation: Situation) -> Command:
        """The first velocity in the order of Q with min(E) >= e_th; else a turn; else a stop.

        All candidates are scored in one call.

        Raises:
            PlannerError: Sensor data are missing, or the bundle does not answer.
            ObservationError: Sensor data are not what the calibration says.
        """
        # Observe: picture, points and history, and the model's features of them.
        scene = self._scorer.scene(situation)
        half_angle = self._scorer.contract.observation.points.laser_scan.half_angle
        points = scan_points(scene.observation.laser_scan, half_angle)
        # V_r and Q, equations (8) and (9).
        candidates, quality = self._restricted(situation, points, scene)
        # E, (K, T): the probability of success of each step of each candidate.
        success = self._scorer.judge(scene, candidates) if len(candidates) else None
        considered = Considered(candidates, quality, success, None)
        # The best by Q among those whose least probability reaches e_th.
        accepted = () if success is None else success.min(axis=1) >= self._e_th
        chosen = _first_accepted(quality, np.asarray(accepted, np.bool_))
        if chosen is not None:
            v, omega = candidates[chosen].tolist()
            return Command(v, omega, considered=replace(considered, chosen=chosen))
        return _turn_or_stop(self._turns(situation, points, scene), considered)

    def _restricted(
        self, situation: Situation, points: Floats, scene: Scene
    ) -> tuple[Floats, Floats]:
        """Velocities (K, 2) of V_r, equation (8), and their Q, equation (9), (K,)."""
        settings = self._settings
        # V_s and V_d: what the robot can reach, and the camera sees.
        window = self._in_view(velocity_window(self._limits, situation.velocity, settings.window))
        # dist of equation (9), by the laser scan.
        way = free_way(window.velocities, points, self._body)
        goal, interval = goal_in_base(situation), settings.window.interval_s
        quality = fox_objective(window, way, goal, self._limits, interval, settings.weights)
        # V_a, where r_point says that the scan can tell.
        free = self._collision_free(window.velocities, way, scene)
        return window.velocities[free], quality[free]

    def _in_view(self, window: VelocityWindow) -> VelocityWindow:
        observed = self._scorer.contract.observation
        horizon_s = observed.horizon_steps * observed.horizon_step_s
        return window.keep(stays_in_view(window.velocities, horizon_s, self._bearings))

    def _collision_free(self, velocities: Floats, way: FreeWay, scene: Scene) -> Mask:
        """V_a, or everything where the cloud is not reliable enough to tell: equation (8)."""
        if scene.observation.r_point <= self._r_th:
            return np.ones(len(velocities), np.bool_)
        return admissible(velocities, way, self._limits, self._settings.reaction_s)

    def _turns(self, situation: Situation, points: Floats, scene: Scene) -> Floats:
        """Rotations (R, 2) on the spot that equation (8) leaves, the preferred one first."""
        error = float(heading_error(np.zeros(3), goal_in_base(situation)))
        yaw_rate = situation.velocity[1]
        turns = turns_on_the_spot(self._limits, yaw_rate, error, points, self._settings.turn)
        return turns[self._collision_free(turns, free_way(turns, points, self._body), scene)]


def _first_accepted(quality: Floats, accepted: Mask) -> int | None:
    """The accepted row of the largest Q, which is where the loop of section IV-G ends."""
    rows = np.flatnonzero(accepted)
    return int(rows[np.argmax(quality[rows])]) if len(rows) else None


def _turn_or_stop(turns: Floats, considered: Considered) -> Command:
    for _, omega in turns.tolist():
        return Command(0.0, omega, "no candidate is accepted: turning on the spot", considered)
    return Command(0.0, 0.0, "no candidate is accepted, and no rotation is free: stop", considered)
