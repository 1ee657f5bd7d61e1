"""Odometry that contradicts itself, or the robot: nothing is driven by that."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import Final

import numpy as np

from graspe_data.geometry import roll_pitch_yaw, rotation_from_quaternion
from graspe_data.robot import Limits
from graspe_data.sensor_data import Motion
from planners.situation import Situation

_LOOKED_BACK_NS: Final = 1_000_000_000
_SLACK_M, _SLACK_RAD = 0.3, 0.3
"""By which a pose may leap, beside what twice the limits allow."""
_BEYOND: Final = 0.5
_TELLING_M: Final = 0.4
"""Less motion in a second than this is not compared."""


def damage_from(limits: Limits) -> tuple[float, float]:
    """From which m/s and rad/s on a velocity is damage: well beyond twice the robot's limits."""
    bounds = (limits.linear_velocity, limits.yaw_rate)
    fastest, quickest = (2 * max(map(abs, bound)) + _BEYOND for bound in bounds)
    return fastest, quickest


def contradiction(situation: Situation, limits: Limits) -> str:
    """What contradicts what, in words; empty where all agrees.

    Held against each other over the last second: velocities against twice the robot's limits,
    successive poses against what such velocities allow, and the way by velocities against that by
    poses.

    Args:
        situation: Of the right kinds, finite.
        limits: Of the robot.
    """
    fastest, quickest = damage_from(limits)
    v, omega = situation.velocity
    if abs(v) > fastest or abs(omega) > quickest:
        return f"the velocity {v:g} m/s, {omega:g} rad/s is beyond twice the robot's limits"
    recent = _recent(situation)
    return _too_fast(recent, fastest) or _leap(recent, fastest, quickest) or _two_ways(recent)


def _recent(situation: Situation) -> list[Motion]:
    since = situation.now_ns - _LOOKED_BACK_NS
    stamped = [m for m in situation.motions if m.stamp_ns is not None and m.stamp_ns >= since]
    return sorted(stamped, key=_stamp)


def _stamp(motion: Motion) -> int:
    return motion.stamp_ns or 0


def _too_fast(motions: Sequence[Motion], fastest: float) -> str:
    speeds = [abs(m.linear_velocity) for m in motions if m.linear_velocity is not None]
    most = max((speed for speed in speeds if math.isfinite(speed)), default=0.0)
    if most <= fastest:
        return ""
    return f"the odometry has {most:g} m/s, which is beyond twice the robot's limits"


def _leap(motions: Sequence[Motion], fastest: float, quickest: float) -> str:
    placed = [m for m in motions if m.position is not None and _finite(m.position)]
    for before, after in pairwise(placed):
        seconds = (_stamp(after) - _stamp(before)) / 1e9
        way = _way(before, after)
        if way > _SLACK_M + fastest * seconds:
            return f"the odometry leaps by {way:.2f} m in {seconds:.2f} s"
        turn = _turn(before, after)
        if turn > _SLACK_RAD + quickest * seconds:
            return f"the odometry turns by {turn:.2f} rad in {seconds:.2f} s"
    return ""


def _two_ways(motions: Sequence[Motion]) -> str:
    """The way of a second by velocities, and that by poses."""
    both = [
        m
        for m in motions
        if m.position is not None and _finite(m.position) and m.linear_velocity is not None
    ]
    steps = list(pairwise(both))
    by_poses = sum(_way(before, after) for before, after in steps)
    by_velocity = sum(
        abs((before.linear_velocity or 0.0) + (after.linear_velocity or 0.0))
        / 2
        * (_stamp(after) - _stamp(before))
        / 1e9
        for before, after in steps
    )
    longer = max(by_poses, by_velocity)
    if not longer > _TELLING_M or abs(by_poses - by_velocity) <= 0.5 * longer:
        return ""
    return (
        f"in the last second the velocities say {by_velocity:.2f} m, the poses {by_poses:.2f} m: "
        f"one of them is wrong, or the wheels slip"
    )


def _way(before: Motion, after: Motion) -> float:
    return math.dist((before.position or ())[:2], (after.position or ())[:2])


def _turn(before: Motion, after: Motion) -> float:
    angles = []
    for motion in (before, after):
        if motion.quaternion is None or not _finite(motion.quaternion):
            return 0.0
        if not any(motion.quaternion):
            return 0.0
        turned = rotation_from_quaternion(np.array(motion.quaternion))
        angles.append(float(roll_pitch_yaw(turned)[2]))
    return abs((angles[1] - angles[0] + math.pi) % (2 * math.pi) - math.pi)


def _finite(values: Sequence[float]) -> bool:
    return all(math.isfinite(value) for value in values)
