"""Twist against poses: which frame the twist is given in, and whether either was ever filled."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np

from graspe_data.arrays import Floats
from graspe_data.synchronisation.levelling import UPWARDS
from graspe_data.synchronisation.motion_samples import MotionSamples
from graspe_data.synchronisation.motion_windows import (
    CONSTANT,
    constant,
    led_astray,
    moves,
    pieces_of,
    turned_astray,
    turns,
)

VelocitySource = Literal["body", "fixed", "differentiated"]
PoseSource = Literal["reported", "integrated"]

AGREES: Final = 0.3
"""Twist and poses agree where the ways they tell differ by less than this share of the way."""
TURNS_AGREE: Final = 0.5
TELLING_M, TELLING_RAD = 0.5, 0.5
"""Less motion than this tells nothing."""


@dataclass(frozen=True)
class MotionEvidence:
    """What twist and poses say of the way of a whole recording, summed over windows of a second.

    Ways in metres and turns in rad: ``posed`` by the poses; ``told`` by the twist, whatever its
    frame. ``body_error`` and ``fixed_error`` are the lengths of the differences between the steps
    by the poses and those by the twist, taken as given in the body's frame and in the fixed one.
    ``turn_error`` and ``fixed_turn_error`` are those of the turns. Only windows in which either
    moves count.
    """

    posed_m: float
    told_m: float
    body_error_m: float
    fixed_error_m: float
    posed_rad: float
    told_rad: float
    turn_error_rad: float
    fixed_turn_error_rad: float
    has_pose: bool
    has_twist: bool
    pose_constant: bool
    heading_constant: bool
    twist_constant: bool
    turn_constant: bool
    windows: int = 0
    apart: int = 0
    """Of the windows with motion, those in which twist and poses differ by more than half."""
    silent: int = 0
    """Of these, those in which not a digit of the twist changes."""
    first_apart_ns: int = 0

    @property
    def telling(self) -> bool:
        """Whether there is motion enough to compare."""
        return max(self.posed_m, self.told_m) >= TELLING_M

    @property
    def turning(self) -> bool:
        """Whether there is turning enough to compare."""
        return max(self.posed_rad, self.told_rad) >= TELLING_RAD

    def share(self, error_m: float) -> float:
        """An error as a share of the longer way."""
        return error_m / max(self.posed_m, self.told_m, CONSTANT)

    @property
    def turn_share(self) -> float:
        """The error of the turns as a share of the larger turn, in the frame that fits better."""
        least = min(self.turn_error_rad, self.fixed_turn_error_rad)
        return least / max(self.posed_rad, self.told_rad, CONSTANT)


def weigh_motion(series: Sequence[MotionSamples], up: Floats = UPWARDS) -> MotionEvidence:
    """Hold twist against poses over the stretches of a recording.

    Args:
        series: The samples of each stretch.
        up: The vertical (3,) in the fixed frame: turns are counted about it.
    """
    pieces = [piece for samples in series for piece in pieces_of(samples, up)]
    moving = [w for piece in pieces for w in piece.windows(moves)]
    turning = [w for piece in pieces for w in piece.windows(turns)]
    # Sums over all windows: the way by poses, by the twist, and the errors of both readings of it.
    ways = np.array([window.ways for window in moving]).reshape(-1, 4)
    turned = np.array([window.turns for window in turning]).reshape(-1, 4)
    posed, by_twist, body, fixed = ways.sum(axis=0).tolist()
    posed_rad, told_rad, turn_error, fixed_turn_error = turned.sum(axis=0).tolist()
    # The windows in which they differ, to say when.
    apart = [w for w in moving if led_astray(w)] + [w for w in turning if turned_astray(w)]
    return MotionEvidence(
        posed_m=posed,
        told_m=by_twist,
        body_error_m=body,
        fixed_error_m=fixed,
        posed_rad=posed_rad,
        told_rad=told_rad,
        turn_error_rad=turn_error,
        fixed_turn_error_rad=fixed_turn_error,
        has_pose=any(np.isfinite(s.position).all(axis=1).any() for s in series),
        has_twist=any(np.isfinite(s.linear[:, 0]).any() for s in series),
        pose_constant=all(constant(s.position) and constant(s.rotation) for s in series),
        heading_constant=all(constant(s.rotation) for s in series),
        twist_constant=all(constant(s.linear) for s in series),
        turn_constant=all(constant(s.angular) for s in series),
        windows=len(moving) + len(turning),
        apart=len(apart),
        silent=sum(step.silent for step in apart),
        first_apart_ns=min((window.begin_ns for window in apart), default=0),
    )
