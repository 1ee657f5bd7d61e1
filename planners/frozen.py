"""Whether a sensor gives the same data time and again, under new stamps, as the robot drives."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from planners.situation import Situation

_LONGEST_STEP_S = 1.0
"""A longer time between two questions is a pause, and counts as no more than this."""
_METRES_A_RADIAN = 1.0
"""A turn changes what sensors see as well."""
_LOOKED_AT = 4096
"""Numbers of a picture or a cloud that are compared, evenly spread."""


@dataclass
class _Held:
    """What a sensor gave: a digest, the stamp with which it came, and the way driven until then."""

    content: bytes
    stamp_ns: int
    way: float


class FrozenWatch:
    """Holds picture, cloud and pose against the way that the odometry says was driven.

    Real sensors are noisy: no two pictures or clouds of a robot that moves are equal to the bit. A
    picture of one grey value is passed over, since a covered lens gives it time and again.
    """

    def __init__(self, longest_m: float) -> None:
        """Take the way in metres after which data that stay the same are frozen."""
        self._longest_m = longest_m
        self._way, self._asked_ns = 0.0, 0
        self._held: dict[str, _Held] = {}

    def frozen(self, situation: Situation, *, picture: bool) -> str:
        """What is frozen, in words; empty where nothing is.

        Args:
            situation: Fit, and no older than the last one.
            picture: Whether pictures matter.
        """
        self._drive(situation)
        seen: dict[str, tuple[bytes, int]] = {"pose": (repr(situation.pose).encode(), 0)}
        if situation.cloud is not None:
            seen["cloud"] = _digest(situation.cloud.xyz), situation.cloud.stamp_ns
        if picture and situation.picture is not None and np.ptp(situation.picture.rgb):
            seen["picture"] = _digest(situation.picture.rgb), situation.picture.stamp_ns
        return next(filter(None, (self._still(name, *value) for name, value in seen.items())), "")

    def _drive(self, situation: Situation) -> None:
        passed_s = min(max((situation.now_ns - self._asked_ns) / 1e9, 0.0), _LONGEST_STEP_S)
        self._asked_ns = situation.now_ns
        v, omega = situation.velocity
        self._way += passed_s * (abs(v) + _METRES_A_RADIAN * abs(omega))

    def _still(self, name: str, content: bytes, stamp_ns: int) -> str:
        held = self._held.get(name)
        if held is None or held.content != content:
            self._held[name] = _Held(content, stamp_ns, self._way)
            return ""
        driven = self._way - held.way
        if name != "pose" and stamp_ns == held.stamp_ns:
            # The same message, not yet followed by another: its age tells.
            return ""
        if driven <= self._longest_m:
            return ""
        return f"the {name} has stayed the same to the bit while the robot drove {driven:.1f} m"


def _digest(values: NDArray[np.generic]) -> bytes:
    flat = values.reshape(-1)
    looked_at = np.ascontiguousarray(flat[:: max(1, flat.size // _LOOKED_AT)])
    return hashlib.blake2b(looked_at.tobytes(), digest_size=16).digest()
