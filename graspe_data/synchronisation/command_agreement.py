"""Commands against odometry: whether a robot that is told to drive ever moves."""

from __future__ import annotations

from typing import Final, Protocol

import numpy as np

from graspe_data.arrays import Floats, Stamps
from graspe_data.errors import RecordingError
from graspe_data.observation.odometry_series import PoseSeries
from graspe_data.robot import Robot
from graspe_data.synchronisation.findings import Finding

SECOND: Final = 1_000_000_000
_TOLD_M: Final = 2.0
_HELD_S: Final = 0.5
_NEVER_MOVES: Final = 1e-9
_DIFFERS: Final = 3.0
_ANSWERS_S: Final = 0.2
_TOLD_M_S, _TOLD_RAD_S = 0.1, 0.1
_ENOUGH: Final = 0.1
_AGAINST: Final = 0.3


class Commands(Protocol):
    """Times int64 (N,) and values (N, 2): m/s and rad/s."""

    @property
    def stamps_ns(self) -> Stamps:
        """When each was given."""

    @property
    def values(self) -> Floats:
        """What was asked for."""


def check_commands(commands: Commands | None, odometry: PoseSeries, robot: Robot) -> list[Finding]:
    """Hold the way that was asked for against the way that the odometry tells.

    Raises:
        RecordingError: Much was asked for and the odometry says, to the last digit, nothing: it was
            never filled.
    """
    if commands is None or robot.topics.command is None:
        return []
    commanded, driven = _way(commands.stamps_ns, commands.values[:, 0], _HELD_S), _driven(odometry)
    topic, source = robot.topics.odometry, robot.topics.command
    if commanded < _TOLD_M:
        return []
    numbers = {"commanded_m": commanded, "driven_m": driven}
    comparison = f"{source} asks for {commanded:.1f} m, {topic} tells {driven:.1f} m"
    if not odometry.velocity.any() and np.ptp(odometry.pose, axis=0).max() <= _NEVER_MOVES:
        raise RecordingError(
            f"{comparison}, and not one of its numbers ever changes: it was never filled. No rows "
            f"are made. Name another odometry under `topics.odometry`, or `odometry: lidar`."
        )
    if opposite := _opposite(commands, odometry):
        text = f"{comparison}, {' and '.join(opposite)} the other way: is a frame turned about?"
        return [Finding("commands_opposite", "noted", source, text, numbers)]
    if driven > _DIFFERS * commanded or commanded > _DIFFERS * driven:
        text = f"{comparison}: commands of another robot, a robot that is held, or another unit"
        return [Finding("commands_differ", "noted", source, text, numbers)]
    text = f"{comparison}: they agree"
    return [Finding("commands_agree", "agrees", source, text, numbers)]


def _opposite(commands: Commands, odometry: PoseSeries) -> list[str]:
    """Which of driving and turning is as a rule the opposite of what was asked for."""
    order = np.argsort(commands.stamps_ns, kind="stable")
    stamps, values = commands.stamps_ns[order], commands.values[order]
    late = odometry.stamps_ns - round(_ANSWERS_S * SECOND)
    latest = np.searchsorted(stamps, late, side="right") - 1
    held = latest >= 0
    held &= late - stamps[np.maximum(latest, 0)] <= _HELD_S * SECOND
    found = []
    for column, name, least in ((0, "driven", _TOLD_M_S), (1, "turned", _TOLD_RAD_S)):
        commanded, reported = values[latest[held], column], odometry.velocity[held, column]
        answered = float(np.sum(commanded * reported))
        strong = np.count_nonzero(np.abs(commanded) > least) >= _ENOUGH * max(1, commanded.size)
        if strong and answered < -_AGAINST * float(np.sum(commanded**2)):
            found.append(name)
    return found


def _driven(odometry: PoseSeries) -> float:
    return _way(odometry.stamps_ns, odometry.velocity[:, 0], _HELD_S)


def _way(stamps_ns: Stamps, speeds: Floats, held_s: float) -> float:
    """The way at speeds (N,) that are held until the next one, no longer than some time, metres."""
    if stamps_ns.size == 0:
        return 0.0
    order = np.argsort(stamps_ns, kind="stable")
    seconds = np.minimum(np.diff(stamps_ns[order]) / SECOND, held_s)
    return float(np.nansum(np.abs(speeds[order][:-1]) * seconds))
