"""What a situation needs so that a planner is asked."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Annotated

import numpy as np
from pydantic import Field

from graspe_data.manifest import Positive, Settings
from graspe_data.sensor_data import Motion, Picture, PointCloud
from planners.goal import GoalSettings
from planners.lidar_clouds import LONGEST_RANGE, misshapen, returns
from planners.situation import Situation

FASTEST, FARTHEST = 100.0, 1e8
"""m/s and rad/s, and metres from a frame's origin, beyond which a number is damage."""

POSE_APART_M = 2.0
"""A pose farther from the latest motion's is none of the odometry; base and odometry's body may lie
somewhat apart."""

MOST_MOTIONS = 20_000
"""Of a situation."""
_NUMBER = (int, float, np.integer)


class GuardSettings(Settings):
    """What a situation needs so that a planner is asked, and how long it may take to answer."""

    picture_age_s: Positive = 0.5
    """Oldest picture that is driven by."""
    cloud_age_s: Positive = 0.5
    """Oldest cloud that is driven by."""
    odometry_age_s: Positive = 0.3
    """Oldest pose and velocity that are driven by."""
    ahead_s: Annotated[float, Field(ge=0)] = 0.05
    """How far a stamp may lie in the future; more means that the clocks differ."""
    stale_m: Positive = 0.4
    """Metres that the robot may have driven since the cloud: at speed a cloud ages sooner."""
    reorder_s: Annotated[float, Field(ge=0)] = 0.1
    """Motions that come late by no more than this are sorted; later ones stop the robot."""
    frozen_m: Positive = 0.5
    """Metres driven after which a pose, a cloud or a picture that stays the same is frozen."""
    needs_picture: bool = True
    """False for planners that drive by the lidar alone."""
    period_s: Positive = 0.1
    """Until the next command: a stop brakes as hard as the robot can in this time."""
    answer_s: Positive = 0.5
    """How long the planner's answer is waited for."""
    goal: GoalSettings = GoalSettings()
    """When the robot has arrived, and when it is given up."""


MOST_RETURNS = 3_000_000
"""Of a cloud; to look through more takes longer than a command may."""


def in_order(situation: Situation, most_s: float) -> Situation:
    """The situation with motions by their stamps, where none is late by more than so long.

    The pipeline takes such odometry as well: several threads of a driver may publish it.
    """
    motions = getattr(situation, "motions", None)
    if not isinstance(motions, Sequence) or len(motions) > MOST_MOTIONS:
        return situation
    stamps = [getattr(motion, "stamp_ns", None) for motion in motions]
    if not all(isinstance(stamp, int) for stamp in stamps):
        return situation
    known = np.array(stamps, np.int64)
    late = np.maximum.accumulate(known) - known if known.size else known
    if not late.any() or late.max() > most_s * 1e9:
        return situation
    order = np.argsort(known, kind="stable").tolist()
    return replace(situation, motions=tuple(motions[place] for place in order))


def unfit(situation: Situation, settings: GuardSettings) -> str:
    """Why a situation cannot be planned in; empty where it can."""
    return (
        _kinds(situation)
        or _numbers(situation)
        or _motions(situation.motions)
        or (_picture(situation, settings) if settings.needs_picture else "")
        or _cloud(situation, settings)
        or _odometry(situation, settings)
    )


def _kinds(situation: Situation) -> str:
    """Whether all that a situation holds is of its kind."""
    held = {
        "situation": (situation, Situation),
        "picture": (getattr(situation, "picture", None), Picture | None),
        "cloud": (getattr(situation, "cloud", None), PointCloud | None),
        "odometry": (getattr(situation, "motions", ()), Sequence),
    }
    for name, (value, kind) in held.items():
        if not isinstance(value, kind):
            return f"the {name} is {_name_of(value)}"
    strange = [each for each in situation.motions[:MOST_MOTIONS] if not isinstance(each, Motion)]
    return f"the odometry has {_name_of(strange[0])} in it" if strange else ""


def _name_of(value: object) -> str:
    return "None" if value is None else f"a {type(value).__name__}"


def _numbers(situation: Situation) -> str:
    bounds = {"velocity": (FASTEST, 2), "pose": (FARTHEST, 3), "goal": (FARTHEST, 2)}
    for name, (most, length) in bounds.items():
        values = getattr(situation, name)
        try:
            numbers = np.asarray(values, np.float64)
        except (TypeError, ValueError, OverflowError):
            return f"the {name} is no numbers: {values!r}"
        if not np.isfinite(numbers).all():
            return f"the {name} is not finite: {values}"
        if numbers.shape != (length,):
            return f"the {name} has the shape {numbers.shape}, expected {length} numbers"
        if (np.abs(numbers) > most).any():
            return f"the {name} is beyond {most:g}: {values}"
    return ""


def _motions(motions: Sequence[Motion]) -> str:
    if len(motions) > MOST_MOTIONS:
        return (
            f"the odometry has {len(motions)} motions, expected the last few seconds: at most "
            f"{MOST_MOTIONS}"
        )
    stamps = [motion.stamp_ns for motion in motions if motion.stamp_ns is not None]
    back = max((first - second for first, second in pairwise(stamps)), default=0)
    return f"the odometry's stamps go back by {back / 1e9:.2f} s" if back > 0 else ""


def _odometry(situation: Situation, settings: GuardSettings) -> str:
    stamp_ns, now_ns = situation.known_ns, situation.now_ns
    if stamp_ns is None:
        return "there is no odometry: nothing tells how old pose and velocity are"
    if situation.odometry_ns is None and (fault := _elsewhere(situation)):
        return fault
    return _late("odometry", stamp_ns, now_ns, settings.odometry_age_s, settings.ahead_s)


def _elsewhere(situation: Situation) -> str:
    """Whether a pose without a stamp of its own is that of the latest motion."""
    positions = [motion.position for motion in situation.motions if motion.position is not None]
    if not positions or not np.isfinite(positions[-1]).all():
        return ""
    apart = float(
        np.hypot(positions[-1][0] - situation.pose[0], positions[-1][1] - situation.pose[1])
    )
    if apart <= POSE_APART_M:
        return ""
    return (
        f"the pose is {apart:.1f} m from the latest motion's, so it comes from elsewhere, and "
        f"nothing tells how old it is: give its stamp as `odometry_ns`"
    )


def _picture(situation: Situation, settings: GuardSettings) -> str:
    picture, now_ns = situation.picture, situation.now_ns
    if picture is None:
        return "there is no picture"
    rgb: object = picture.rgb
    if not isinstance(rgb, np.ndarray):
        return f"the picture is {_name_of(rgb)}, expected uint8 (H, W, 3)"
    if rgb.dtype != np.uint8 or (rgb.ndim, rgb.shape[-1:]) != (3, (3,)):
        return f"the picture is {rgb.dtype} {rgb.shape}, expected uint8 (H, W, 3)"
    return _late("picture", picture.stamp_ns, now_ns, settings.picture_age_s, settings.ahead_s)


def _cloud(situation: Situation, settings: GuardSettings) -> str:
    cloud, now_ns = situation.cloud, situation.now_ns
    if cloud is None:
        return "there is no cloud"
    if len(cloud.xyz) > MOST_RETURNS:
        return f"the cloud has {len(cloud.xyz)} returns, more than {MOST_RETURNS}"
    fault = misshapen(cloud)
    fault = fault or _late("cloud", cloud.stamp_ns, now_ns, settings.cloud_age_s, settings.ahead_s)
    # A lidar that works sees the ground at least.
    if not fault and not returns(cloud.xyz).any():
        return f"the cloud has no return within {LONGEST_RANGE:g} m: no lidar sees"
    return fault


def driven_since(situation: Situation, most_m: float) -> str:
    """Whether the robot has driven far since its cloud was taken; empty where it has not."""
    if situation.cloud is None:
        return ""
    age_s = max(0.0, (situation.now_ns - situation.cloud.stamp_ns) / 1e9)
    metres = abs(situation.velocity[0]) * age_s
    if not metres > most_m:
        return ""
    return (
        f"the cloud is {age_s:.2f} s old at {situation.velocity[0]:g} m/s: the robot has driven "
        f"{metres:.2f} m since, more than {most_m:g} m"
    )


def _late(name: str, stamp_ns: object, now_ns: object, oldest_s: float, ahead_s: float) -> str:
    if not (isinstance(stamp_ns, _NUMBER) and isinstance(now_ns, _NUMBER)):
        return f"the {name} has the stamp {stamp_ns!r} at {now_ns!r}, expected nanoseconds"
    age = float(now_ns - stamp_ns) / 1e9
    if -ahead_s <= age <= oldest_s:
        return ""
    if age < 0:
        return f"the {name} is {-age:.2f} s in the future: its clock is not the robot's"
    return f"the {name} is {age:.2f} s old, more than {oldest_s:g} s"
