"""A planner that never raises and never drives on bad input."""

from __future__ import annotations

import logging
import math
from typing import Annotated

import numpy as np
from pydantic import Field

from graspe_data.errors import GraspeError
from graspe_data.manifest import Settings
from graspe_data.robot import Limits
from planners.situation import Command, Considered, Planner, Situation

LOGGER_NAME = "planners"

Age = Annotated[float, Field(gt=0)]

_TOLERANCE = 1e-6


class GuardSettings(Settings):
    """What a situation needs so that a planner is asked."""

    picture_age_s: Age = 0.5
    """Oldest picture that is driven by."""
    cloud_age_s: Age = 0.5
    """Oldest cloud that is driven by."""
    ahead_s: Annotated[float, Field(ge=0)] = 0.05
    """How far a stamp may lie in the future; more means that the clocks differ."""
    needs_picture: bool = True
    """False for planners that drive by the lidar alone."""
    period_s: Age = 0.1
    """Until the next command: a stop brakes as hard as the robot can in this time."""


class Guarded:
    """Asks another planner, and stops where that has no sense or does not work.

    Every stop of its own has a reason, which is logged as a warning to the logger ``planners``.
    """

    def __init__(
        self, planner: Planner, limits: Limits, settings: GuardSettings | None = None
    ) -> None:
        """Take the planner and the limits of the robot that it drives."""
        self._planner, self._limits = planner, limits
        self._settings = settings or GuardSettings()
        self._log = logging.getLogger(LOGGER_NAME)

    def command(self, situation: Situation) -> Command:
        """The planner's command, or a stop with a reason; never an exception."""
        try:
            reason = self._unfit(situation)
            if reason:
                return self._stop(situation, reason)
            command = self._planner.command(situation)
            reason = self._beyond(command)
        except GraspeError as error:
            return self._stop(situation, str(error))
        except Exception as error:  # noqa: BLE001 - whatever it is, the robot must not drive on
            self._log.exception("the planner failed")
            return self._stop(situation, f"{type(error).__name__}: {error}")
        return self._stop(situation, reason, command.considered) if reason else command

    def _unfit(self, situation: Situation) -> str:
        """Why a situation cannot be planned in; empty where it can."""
        numbers = {"velocity": situation.velocity, "pose": situation.pose, "goal": situation.goal}
        for name, values in numbers.items():
            if not np.isfinite(np.asarray(values, np.float64)).all():
                return f"the {name} is not finite: {values}"
        settings = self._settings
        if settings.needs_picture:
            stamp = None if situation.picture is None else situation.picture.stamp_ns
            if late := self._late("picture", stamp, situation.now_ns, settings.picture_age_s):
                return late
        stamp = None if situation.cloud is None else situation.cloud.stamp_ns
        return self._late("cloud", stamp, situation.now_ns, settings.cloud_age_s)

    def _late(self, name: str, stamp_ns: int | None, now_ns: int, oldest_s: float) -> str:
        if stamp_ns is None:
            return f"there is no {name}"
        age = (now_ns - stamp_ns) / 1e9
        if age > oldest_s:
            return f"the {name} is {age:.2f} s old, more than {oldest_s:g} s"
        if age < -self._settings.ahead_s:
            return f"the {name} is {-age:.2f} s in the future: its clock is not the robot's"
        return ""

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
        self, situation: Situation, reason: str, considered: Considered | None = None
    ) -> Command:
        """The slowest velocity that the robot can have reached by the next command."""
        self._log.warning("stop: %s", reason)
        limits, period = self._limits, self._settings.period_s
        v, omega = _numbers(situation.velocity)
        slower = _toward_zero(v, limits.linear_acceleration * period)
        straighter = _toward_zero(omega, limits.yaw_acceleration * period)
        return Command(
            _clipped(slower, limits.linear_velocity),
            _clipped(straighter, limits.yaw_rate),
            f"stop: {reason}",
            considered,
        )


def _numbers(velocity: tuple[float, float]) -> tuple[float, float]:
    """A velocity, and standing still for what is none."""
    try:
        v, omega = (float(value) for value in velocity)
    except (TypeError, ValueError):
        return 0.0, 0.0
    return (v, omega) if math.isfinite(v) and math.isfinite(omega) else (0.0, 0.0)


def _toward_zero(value: float, reach: float) -> float:
    return math.copysign(max(abs(value) - reach, 0.0), value)


def _clipped(value: float, bounds: tuple[float, float]) -> float:
    """A velocity that is no further from 0 than the limits are."""
    return min(max(value, min(bounds[0], 0.0)), max(bounds[1], 0.0))
