"""A planner that never raises, always answers in time, and never drives on bad input."""

from __future__ import annotations

import logging
import math
from typing import Any

from graspe_data.errors import GraspeError
from graspe_data.robot import Limits
from planners.deadline import Deadline
from planners.fitness import FASTEST, GuardSettings, unfit
from planners.frozen import FrozenWatch
from planners.progress import GoalWatch
from planners.situation import Command, Considered, Planner, Situation

LOGGER_NAME = "planners"

_TOLERANCE = 1e-6


class Guarded:
    """Asks another planner, and stops where that has no sense, does not work or takes too long.

    It also stops at the goal, and where the robot gets no nearer to it. Every stop of its own has a
    reason, which is logged to the logger ``planners``: as a warning, but for an arrival.
    """

    def __init__(
        self, planner: Planner, limits: Limits, settings: GuardSettings | None = None
    ) -> None:
        """Take the planner and the limits of the robot that it drives."""
        self._planner, self._limits = planner, limits
        self._settings = settings or GuardSettings()
        self._latest_ns: int | None = None
        self._answers = Deadline[Command](self._settings.answer_s)
        self._watch = GoalWatch(self._settings.goal)
        self._frozen = FrozenWatch(self._settings.frozen_m)
        self._braking: tuple[float, float] | None = None
        self._log = logging.getLogger(LOGGER_NAME)

    def command(self, situation: Situation) -> Command:
        """The planner's command, or a stop with a reason; never an exception."""
        try:
            reason = (
                unfit(situation, self._settings)
                or self._went_back(situation.now_ns)
                or self._frozen.frozen(situation, picture=self._settings.needs_picture)
            )
            if reason:
                return self._stop(situation, reason)
            standing = self._watch.standing(situation)
            if standing:
                return self._stop(situation, standing.reason, arrived=standing.arrived)
            command = self._answers.ask(lambda: self._planner.command(situation))
            reason = self._beyond(command)
        except GraspeError as error:
            return self._stop(situation, str(error))
        except Exception as error:  # noqa: BLE001 - whatever it is, the robot must not drive on
            self._log.exception("the planner failed")
            return self._stop(situation, f"{type(error).__name__}: {error}")
        if reason:
            return self._stop(situation, reason, command.considered)
        self._braking = None
        return command

    def _went_back(self, now_ns: int) -> str:
        """Whether the robot's clock was set back since the last situation."""
        before, self._latest_ns = self._latest_ns, now_ns
        if before is None or now_ns >= before:
            return ""
        return f"the clock went back by {(before - now_ns) / 1e9:.2f} s"

    def _beyond(self, command: Command) -> str:
        """Why a command cannot be driven; empty where it can."""
        asked = {
            "linear velocity": (command.linear_velocity, self._limits.linear_velocity),
            "yaw rate": (command.yaw_rate, self._limits.yaw_rate),
        }
        for name, (value, (low, high)) in asked.items():
            # A stop is always allowed, and NaN is within no limits.
            if value != 0 and not low - _TOLERANCE <= value <= high + _TOLERANCE:
                return f"the planner's {name} {value:g} is not within {low:g}..{high:g}"
        return ""

    def _stop(
        self,
        situation: Situation,
        reason: str,
        considered: Considered | None = None,
        *,
        arrived: bool = False,
    ) -> Command:
        """The slowest velocity that the robot can have reached by the next command.

        A stop that goes on brakes on from its own last command: the velocity that the situation
        states may be the one that is wrong, or that of a second ago.
        """
        self._log.log(logging.INFO if arrived else logging.WARNING, "stop: %s", reason)
        limits, period = self._limits, self._settings.period_s
        v, omega = _numbers(getattr(situation, "velocity", None))
        v, omega = _clipped(v, limits.linear_velocity), _clipped(omega, limits.yaw_rate)
        if self._braking is not None:
            v, omega = _slower(v, self._braking[0]), _slower(omega, self._braking[1])
        v = _toward_zero(v, limits.linear_acceleration * period)
        omega = _toward_zero(omega, limits.yaw_acceleration * period)
        self._braking = v, omega
        return Command(v, omega, f"stop: {reason}", considered, arrived)


def _numbers(velocity: Any) -> tuple[float, float]:
    """A velocity, and standing still for what is none, or damage."""
    try:
        v, omega = (float(value) for value in velocity)
    except (TypeError, ValueError, OverflowError):
        return 0.0, 0.0
    # NaN is not within.
    return (v, omega) if abs(v) <= FASTEST and abs(omega) <= FASTEST else (0.0, 0.0)


def _toward_zero(value: float, reach: float) -> float:
    return math.copysign(max(abs(value) - reach, 0.0), value)


def _slower(value: float, other: float) -> float:
    """The one nearer to 0; 0 where they have opposite signs."""
    return min(value, other, key=abs) if value * other > 0 else 0.0


def _clipped(value: float, bounds: tuple[float, float]) -> float:
    """A velocity that is no further from 0 than the limits are."""
    return min(max(value, min(bounds[0], 0.0)), max(bounds[1], 0.0))
