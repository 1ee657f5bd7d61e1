"""What a situation needs so that a planner is asked."""

from __future__ import annotations

from itertools import pairwise
from typing import Annotated

import numpy as np
from pydantic import Field

from graspe_data.manifest import Settings
from graspe_data.sensor_data import Picture, PointCloud
from planners.situation import Situation

Age = Annotated[float, Field(gt=0)]

FASTEST, FARTHEST = 100.0, 1e8
"""m/s and rad/s, and metres from a frame's origin, beyond which a number is damage."""
LONGEST_RANGE = 1000.0
"""Metres; a return from farther away is damage."""


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


def unfit(situation: Situation, settings: GuardSettings) -> str:
    """Why a situation cannot be planned in; empty where it can."""
    faults = [_numbers(situation), _motions(situation)]
    if settings.needs_picture:
        faults += [_picture(situation.picture, situation.now_ns, settings)]
    faults += [_cloud(situation.cloud, situation.now_ns, settings)]
    return next(filter(None, faults), "")


def _numbers(situation: Situation) -> str:
    bounds = {"velocity": FASTEST, "pose": FARTHEST, "goal": FARTHEST}
    for name, most in bounds.items():
        values = getattr(situation, name)
        numbers = np.asarray(values, np.float64)
        if not np.isfinite(numbers).all():
            return f"the {name} is not finite: {values}"
        if (np.abs(numbers) > most).any():
            return f"the {name} is beyond {most:g}: {values}"
    return ""


def _motions(situation: Situation) -> str:
    stamps = [motion.stamp_ns for motion in situation.motions if motion.stamp_ns is not None]
    back = max((first - second for first, second in pairwise(stamps)), default=0)
    return f"the odometry's stamps go back by {back / 1e9:.2f} s" if back > 0 else ""


def _picture(picture: Picture | None, now_ns: int, settings: GuardSettings) -> str:
    if picture is None:
        return "there is no picture"
    rgb = picture.rgb
    if rgb.dtype != np.uint8 or (rgb.ndim, rgb.shape[-1:]) != (3, (3,)):
        return f"the picture is {rgb.dtype} {rgb.shape}, expected uint8 (H, W, 3)"
    return _late("picture", picture.stamp_ns, now_ns, settings.picture_age_s, settings.ahead_s)


def _cloud(cloud: PointCloud | None, now_ns: int, settings: GuardSettings) -> str:
    if cloud is None:
        return "there is no cloud"
    xyz = cloud.xyz
    floating = np.issubdtype(xyz.dtype, np.floating)
    if not floating or (xyz.ndim, xyz.shape[-1:]) != (2, (3,)):
        return f"the cloud is {xyz.dtype} {xyz.shape}, expected float32 (N, 3) in metres"
    late = _late("cloud", cloud.stamp_ns, now_ns, settings.cloud_age_s, settings.ahead_s)
    return late or _unseeing(cloud)


def _unseeing(cloud: PointCloud) -> str:
    """A lidar that works sees the ground at least."""
    with np.errstate(over="ignore", invalid="ignore"):
        square = np.einsum("ij,ij->i", cloud.xyz, cloud.xyz)
        returns = np.count_nonzero((square > 0) & (square <= LONGEST_RANGE**2))
    return "" if returns else f"the cloud has no return within {LONGEST_RANGE:g} m: no lidar sees"


def _late(name: str, stamp_ns: int, now_ns: int, oldest_s: float, ahead_s: float) -> str:
    age = (now_ns - stamp_ns) / 1e9
    if -ahead_s <= age <= oldest_s:
        return ""
    if age < 0:
        return f"the {name} is {-age:.2f} s in the future: its clock is not the robot's"
    return f"the {name} is {age:.2f} s old, more than {oldest_s:g} s"
