"""The randomised planner: it explores, fails, backs off and goes on."""

from __future__ import annotations

from collections import deque

import numpy as np

from graspe_data.arrays import Floats
from graspe_data.robot import Robot
from graspe_data.simulation.motion.arc_choice import ArcChoice
from graspe_data.simulation.motion.drivers import Leg, RobotState
from graspe_data.simulation.motion.planner_settings import PlannerSettings
from graspe_data.simulation.world.world import World

HELD_SHARE = 0.2
HELD_TIMES = 3
START_S = 1.0
MOST_BACKS = 4
NEAR_WAYPOINT = 1.5
WAYPOINT_S = 8.0
CURIOUS_S = 25.0
REVERSAL_S = 1.0
REVERSALS = 4


class RandomPlanner:
    """Holds random arcs toward random waypoints; held by something, it pushes and backs off."""

    def __init__(
        self,
        world: World,
        robot: Robot,
        settings: PlannerSettings,
        generator: np.random.Generator,
    ) -> None:
        """Start without a plan."""
        self._arena = np.reshape(world.arena, (2, 2))
        self._settings = settings
        self._generator = generator
        self._choice = ArcChoice(world, robot, settings, generator)
        self._legs: deque[Leg] = deque()
        self._leg = Leg(0.0, 0.0, 0.0)
        self._since = 0.0
        self._until = 0.0
        self._recovery = ""
        self._held = 0
        self._backs = 0
        self._waypoint = np.zeros(2)
        self._waypoint_until = 0.0
        self._caution = settings.caution
        self._wary = False

    def command(self, state: RobotState) -> tuple[float, float]:
        """Linear velocity in m/s and yaw rate in rad/s to hold until asked again."""
        self._held = self._held + 1 if self._is_held(state) else 0
        if self._held >= HELD_TIMES:
            self._give_way(state)
        elif state.time_s >= self._until - 1e-9:
            self._take(self._legs.popleft() if self._legs else self._next(state), state)
        return self._leg.linear_velocity, self._leg.yaw_rate

    def _is_held(self, state: RobotState) -> bool:
        v, omega = self._leg.linear_velocity, self._leg.yaw_rate
        commanded, driven = (v, state.velocity[0]) if v else (omega, state.velocity[1])
        touched = state.stopped or state.entangled
        judged = self._recovery != "push" and state.time_s >= self._since + START_S
        return judged and touched and abs(driven) < HELD_SHARE * abs(commanded)

    def _give_way(self, state: RobotState) -> None:
        """Held on the way, go on pushing; held in a recovery, try its next part."""
        self._held = 0
        self._legs.clear()
        if self._recovery:
            self._backs = MOST_BACKS
            self._take(self._next(state), state)
        else:
            self._recovery, self._backs = "push", 0
            self._waypoint_until, self._caution, self._wary = 0.0, 1.0, True
            self._until = state.time_s + self._choice.uniform(self._settings.push_s)

    def _take(self, leg: Leg, state: RobotState) -> None:
        self._leg = leg
        self._since = state.time_s
        self._until = state.time_s + leg.duration_s

    def _next(self, state: RobotState) -> Leg:
        caught = self._recovery == "back" and state.entangled and self._backs < MOST_BACKS
        if self._recovery == "push" or caught:
            self._recovery = "back"
            self._backs += 1
            return self._back()
        pose = np.array(state.pose)
        if self._recovery == "back":
            self._recovery = "turn"
            return self._choice.turn(pose)
        self._recovery = ""
        return self._explore(pose, state.time_s)

    def _back(self) -> Leg:
        """Away from where the robot was going."""
        speed = self._choice.uniform(self._settings.back_speed)
        forward = self._leg.linear_velocity >= 0
        return Leg(self._choice.uniform(self._settings.back_s), -speed if forward else speed, 0.0)

    def _explore(self, pose: Floats, time_s: float) -> Leg:
        stand, turn, oscillate = np.cumsum(
            [self._settings.stand, self._settings.turn, self._settings.oscillate]
        )
        drawn = self._generator.random()
        if drawn < stand:
            return Leg(self._choice.uniform(self._settings.hold_s), 0.0, 0.0)
        if turn <= drawn < oscillate:
            return self._oscillate()
        self._choose_waypoint(pose, time_s)
        onward = None if drawn < turn else self._choice.onward(pose, self._waypoint, self._caution)
        turning = 0.0 if self._leg.linear_velocity else self._leg.yaw_rate
        return onward or self._choice.turn(pose, turning)

    def _oscillate(self) -> Leg:
        """To and fro on the spot."""
        rate = self._choice.turn_rate()
        legs = [Leg(REVERSAL_S, 0.0, rate * (-1) ** turn) for turn in range(REVERSALS + 1)]
        self._legs.extend(legs[1:])
        return legs[0]

    def _choose_waypoint(self, pose: Floats, time_s: float) -> None:
        near = np.hypot(*(self._waypoint - pose[:2])) < NEAR_WAYPOINT
        if (near and self._caution > 0) or time_s >= self._waypoint_until:
            tempted = self._is_tempted(pose)
            if not tempted:
                self._waypoint = self._anywhere()
            self._waypoint_until = time_s + (CURIOUS_S if tempted else WAYPOINT_S)

    def _is_tempted(self, pose: Floats) -> bool:
        """Whether the next waypoint is, by curiosity, something that could hold the robot."""
        wary, self._wary = self._wary, False
        self._caution = 1.0 if wary else self._settings.caution
        if wary or self._generator.random() >= self._settings.curiosity:
            return False
        point = self._choice.temptation(pose)
        if point is None:
            return False
        self._waypoint, self._caution = point, 0.0
        return True

    def _anywhere(self) -> Floats:
        low, high = self._arena + self._settings.margin * np.array([[1.0], [-1.0]])
        point: Floats = self._generator.uniform(np.minimum(low, high), np.maximum(low, high))
        return point
