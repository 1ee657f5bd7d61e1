"""Whether a sensor gives the same data time and again, under new stamps, as the robot drives."""

from __future__ import annotations

import hashlib
import math
from collections import OrderedDict
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from planners.goal import LONGEST_STEP_S
from planners.situation import Pose, Situation

_METRES_A_RADIAN = 1.0
"""A turn changes what sensors see as well."""
_REMEMBERED = 64
"""Contents of a sensor."""
_LOOKED_AT = 4096
"""Numbers of a picture or a cloud that are compared, evenly spread."""


@dataclass
class _Sighting:
    """A content: the stamp with which it came last, and the way driven when it came first."""

    stamp_ns: int
    way: float


class FrozenWatch:
    """Holds picture, cloud and pose against the way that the robot drives.

    Real sensors are noisy: no two pictures or clouds of a robot that moves are equal to the bit,
    however many lie between them. A picture of one grey value is passed over, since a covered lens
    gives it time and again.
    """

    def __init__(self, longest_m: float) -> None:
        """Take the way in metres after which data that come again are frozen."""
        self._longest_m = longest_m
        self._odometry_way, self._longest_way, self._last_ns = 0.0, 0.0, 0
        self._pose: Pose | None = None
        self._sightings: dict[str, OrderedDict[bytes, _Sighting]] = {}

    def frozen(self, situation: Situation, commanded: tuple[float, float], *, picture: bool) -> str:
        """What is frozen, in words; empty where nothing is.

        Args:
            situation: Fit, and no older than the last one.
            commanded: The last command, m/s and rad/s: a robot whose odometry is frozen too says
                that it stands.
            picture: Whether pictures matter.
        """
        self._drive(situation, commanded)
        pose = repr(situation.pose).encode()
        faults = [self._again("pose", pose, situation.now_ns, self._odometry_way, last=1)]
        if situation.cloud is not None:
            content, stamp_ns = _digest(situation.cloud.xyz), situation.cloud.stamp_ns
            faults.append(self._again("cloud", content, stamp_ns, self._longest_way))
        if picture and situation.picture is not None and np.ptp(situation.picture.rgb):
            content, stamp_ns = _digest(situation.picture.rgb), situation.picture.stamp_ns
            faults.append(self._again("picture", content, stamp_ns, self._longest_way))
        return next(filter(None, faults), "")

    def _drive(self, situation: Situation, commanded: tuple[float, float]) -> None:
        """Count the way by velocities, and the longest by velocities, poses and commands."""
        passed_s = min(max((situation.now_ns - self._last_ns) / 1e9, 0.0), LONGEST_STEP_S)
        self._last_ns = situation.now_ns
        by_odometry, by_command = (
            passed_s * (abs(v) + _METRES_A_RADIAN * abs(omega))
            for v, omega in (situation.velocity, commanded)
        )
        moved = 0.0 if self._pose is None else math.dist(self._pose[:2], situation.pose[:2])
        self._pose = situation.pose
        self._odometry_way += by_odometry
        self._longest_way += max(by_odometry, by_command, min(moved, self._longest_m))

    def _again(
        self, name: str, content: bytes, stamp_ns: int, way: float, last: int = _REMEMBERED
    ) -> str:
        """Whether a content was there before, under another stamp, so long a way ago."""
        sightings = self._sightings.setdefault(name, OrderedDict())
        earlier = sightings.get(content)
        if earlier is None:
            sightings[content] = _Sighting(stamp_ns, way)
            while len(sightings) > last:
                sightings.popitem(last=False)
            return ""
        waits = name != "pose" and stamp_ns == earlier.stamp_ns
        earlier.stamp_ns = stamp_ns
        metres = way - earlier.way
        if waits or metres <= self._longest_m:
            # The same message, not yet followed by another: its age tells.
            return ""
        return f"the {name} has stayed the same to the bit while the robot drove {metres:.1f} m"


def _digest(values: NDArray[np.generic]) -> bytes:
    flat = values.reshape(-1)
    looked_at = np.ascontiguousarray(flat[:: max(1, flat.size // _LOOKED_AT)])
    return hashlib.blake2b(looked_at.tobytes(), digest_size=16).digest()
