"""A planner that never raises, always answers in time, and never drives on bad input."""

from __future__ import annotations

import logging
import math
import time
from collections.abc import Callable
from contextlib import suppress
from typing import Any

from graspe_data.errors import GraspeError
from graspe_data.robot import Limits
from planners.deadline import Deadline
from planners.fitness import FASTEST, GuardSettings, driven_since, in_order, unfit
from planners.frozen import FrozenWatch
from planners.goal import GoalWatch
from planners.motion_agreement import contradiction, damage_from
from planners.situation import Command, Considered, Planner, Situation

LOGGER_NAME = "planners"

_TOLERANCE = 1e-6
_EVERY_S = 1.0
"""Between two lines of the log with the same reason."""


class Guarded:
    """Asks another planner, and stops where that has no sense, does not work or takes too long.

    It also stops at the goal, and where the robot gets no nearer to it. Every stop of its own has a
    reason, which is logged to the logger ``planners``: as a warning, but for an arrival. A reason
    that stays the same is logged once a second. Handlers run in the caller's thread: give the
    logger one that does not block, such as ``logging.handlers.QueueHandler``.
    """

    def __init__(
        self,
        planner: Planner,
        limits: Limits,
        settings: GuardSettings | None = None,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        """Take the planner and the limits of the robot that it drives.

        Args:
            planner: Who is asked.
            limits: Of the robot.
            settings: What a situation needs.
            clock: Seconds that go on whatever the robot's clock does.
        """
        self._planner, self._limits = planner, limits
        settings = settings or GuardSettings()
        looks = settings.needs_picture or getattr(planner, "needs_picture", False)
        self._settings = settings.model_copy(update={"needs_picture": looks})
        self._clock, self._renewed_s = clock, 0.0
        self._latest: dict[str, int] = {}
        self._answers = Deadline[Command](self._settings.answer_s)
        self._watch = GoalWatch(self._settings.goal)
        self._frozen = FrozenWatch(self._settings.frozen_m)
        self._last_velocity = (0.0, 0.0)
        self._last_reason, self._last_reason_s = "", -math.inf
        self._log = logging.getLogger(LOGGER_NAME)

    def command(self, situation: Situation) -> Command:
        """The planner's command, or a stop with a reason; never an exception."""
        try:
            command = self._decide(in_order(situation, self._settings.reorder_s))
        except Exception as error:  # noqa: BLE001 - whatever it is, the robot must not drive on
            is_ours = isinstance(error, GraspeError)
            text = _text(error)
            if not is_ours:
                self._tell(logging.ERROR, f"the planner failed: {text}")
            command = self._stop(situation, text if is_ours else f"{type(error).__name__}: {text}")
        self._last_velocity = command.linear_velocity, command.yaw_rate
        return command

    def _decide(self, situation: Situation) -> Command:
        settings = self._settings
        reason = (
            unfit(situation, settings)
            or self._went_back(situation)
            or contradiction(situation, self._limits)
            or driven_since(situation, settings.stale_m)
            or self._frozen.frozen(situation, self._last_velocity, picture=settings.needs_picture)
        )
        if reason:
            return self._stop(situation, reason)
        standing = self._watch.standing(situation)
        if standing:
            return self._stop(situation, standing.reason, arrived=standing.arrived)
        command = self._answers.ask(lambda: self._planner.command(situation))
        reason = self._beyond(command)
        return self._stop(situation, reason, command.considered) if reason else command

    def _went_back(self, situation: Situation) -> str:
        """Whether the robot's clock, or a sensor's stamps, go back or stand still."""
        now_ns, clock_s = situation.now_ns, self._clock()
        stamps = {"clock": now_ns}
        if situation.cloud is not None:
            stamps["cloud's stamp"] = situation.cloud.stamp_ns
        if self._settings.needs_picture and situation.picture is not None:
            stamps["picture's stamp"] = situation.picture.stamp_ns
        before, self._latest = self._latest, stamps
        for name, stamp in stamps.items():
            if stamp < before.get(name, stamp):
                return f"the {name} went back by {(before[name] - stamp) / 1e9:.2f} s"
        if now_ns != before.get("clock"):
            self._renewed_s = clock_s
        stood_s = clock_s - self._renewed_s
        if stood_s <= self._settings.odometry_age_s:
            return ""
        return f"the clock has stood still for {stood_s:.2f} s: the situation is not renewed"

    def _beyond(self, command: Command) -> str:
        """Why a command cannot be driven; empty where it can."""
        velocities = {
            "linear velocity": (command.linear_velocity, self._limits.linear_velocity),
            "yaw rate": (command.yaw_rate, self._limits.yaw_rate),
        }
        for name, (value, (low, high)) in velocities.items():
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

        It brakes from the last command, and no faster than the robot says that it drives: the
        velocity that the situation states may be the one that is wrong.
        """
        self._tell(logging.INFO if arrived else logging.WARNING, f"stop: {reason}")
        limits, period = self._limits, self._settings.period_s
        v, omega = _numbers(situation)
        if abs(v) > damage_from(limits)[0]:
            v, omega = 0.0, 0.0
        v, omega = _clipped(v, limits.linear_velocity), _clipped(omega, limits.yaw_rate)
        v, omega = _slower(v, self._last_velocity[0]), _slower(omega, self._last_velocity[1])
        v = _toward_zero(v, limits.linear_acceleration * period)
        omega = _toward_zero(omega, limits.yaw_acceleration * period)
        return Command(v, omega, f"stop: {reason}", considered, arrived)

    def _tell(self, level: int, text: str) -> None:
        """Log a reason when it changes, and once a second; a handler that fails stops nobody."""
        now_s = self._clock()
        if text == self._last_reason and now_s - self._last_reason_s < _EVERY_S:
            return
        self._last_reason, self._last_reason_s = text, now_s
        with suppress(Exception):
            self._log.log(level, "%s", text)


def _text(error: BaseException) -> str:
    try:
        return str(error)
    except Exception:  # noqa: BLE001 - an error that cannot even be told
        return "no words"


def _numbers(situation: Any) -> tuple[float, float]:
    """The velocity of a situation, and standing still for what is none, or damage."""
    try:
        v, omega = (float(value) for value in situation.velocity)
    except Exception:  # noqa: BLE001 - a situation may be anything
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
