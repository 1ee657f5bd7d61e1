"""Twist against poses: which frame the twist is given in, and whether either was ever filled."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np

from graspe_data.geometry import Floats
from graspe_data.synchronisation.motion_samples import SECOND, MotionSamples

VelocitySource = Literal["body", "fixed", "differentiated"]
PoseSource = Literal["reported", "integrated"]

WINDOW_S: Final = 1.0
AGREES: Final = 0.3
"""Twist and poses agree where the ways they tell differ by less than this share of the way."""
TURNS_AGREE: Final = 0.5
TELLING_M, TELLING_RAD = 0.5, 0.5
"""Less motion than this tells nothing."""
_STANDING_M, _STANDING_RAD = 0.05, 0.1
_CONSTANT: Final = 1e-9


@dataclass(frozen=True)
class MotionEvidence:
    """What twist and poses say of the way of a whole recording, summed over windows of a second.

    Ways in metres and turns in rad: ``posed`` by the poses; ``told`` by the twist, whatever its
    frame. ``body_error`` and ``fixed_error`` are the lengths of the differences between the steps
    by the poses and those by the twist, taken as given in the body's frame and in the fixed one.
    ``turn_error`` is that of the turns. Only windows in which either moves count.
    """

    posed_m: float
    told_m: float
    body_error_m: float
    fixed_error_m: float
    posed_rad: float
    told_rad: float
    turn_error_rad: float
    has_pose: bool
    has_twist: bool
    pose_constant: bool
    heading_constant: bool
    twist_constant: bool
    turn_constant: bool

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
        return error_m / max(self.posed_m, self.told_m, _CONSTANT)

    @property
    def turn_share(self) -> float:
        """The error of the turns as a share of the larger turn."""
        return self.turn_error_rad / max(self.posed_rad, self.told_rad, _CONSTANT)


def weigh_motion(series: Sequence[MotionSamples]) -> MotionEvidence:
    """Hold twist against poses over the stretches of a recording."""
    steps = [window for samples in series for window in _windows(samples)]
    ways = np.array([step.ways for step in steps]).reshape(-1, 4)
    turns = np.array([step.turns for step in steps]).reshape(-1, 3)
    moving = (ways[:, 0] > _STANDING_M) | (ways[:, 1] > _STANDING_M)
    turning = (turns[:, 0] > _STANDING_RAD) | (turns[:, 1] > _STANDING_RAD)
    posed, told, body, fixed = ways[moving].sum(axis=0).tolist()
    posed_rad, told_rad, turn_error = turns[turning].sum(axis=0).tolist()
    return MotionEvidence(
        posed_m=posed,
        told_m=told,
        body_error_m=body,
        fixed_error_m=fixed,
        posed_rad=posed_rad,
        told_rad=told_rad,
        turn_error_rad=turn_error,
        has_pose=any(np.isfinite(s.position).all(axis=1).any() for s in series),
        has_twist=any(np.isfinite(s.linear[:, 0]).any() for s in series),
        pose_constant=all(_constant(s.position) and _constant(s.rotation) for s in series),
        heading_constant=all(_constant(s.rotation) for s in series),
        twist_constant=all(_constant(s.linear) for s in series),
        turn_constant=all(_constant(s.angular) for s in series),
    )


@dataclass(frozen=True)
class _Window:
    """One window: the lengths of the ways (posed, told, body error, fixed error), and turns."""

    ways: tuple[float, float, float, float]
    turns: tuple[float, float, float]


def _windows(samples: MotionSamples) -> Iterator[_Window]:
    """The windows of a second of the stretches in which samples follow one another."""
    count = samples.stamps_ns.size
    pieces = np.split(np.arange(count), np.flatnonzero(~samples.joined) + 1) if count else []
    position = np.nan_to_num(samples.position)
    yaw = np.nan_to_num(samples.yaw)
    rotation = np.where(np.isnan(samples.rotation), np.eye(3), samples.rotation)
    fixed = np.nan_to_num(samples.linear)
    body = np.einsum("nij,nj->ni", rotation, fixed)
    rate = np.nan_to_num(samples.angular)
    turning = np.einsum("nij,nj->ni", rotation, rate)[:, 2]
    for piece in pieces:
        seconds = (samples.stamps_ns[piece] - samples.stamps_ns[piece[0]]) / SECOND
        by_fixed, by_body = _integral(fixed[piece], seconds), _integral(body[piece], seconds)
        turned = _integral(turning[piece][:, None], seconds)[:, 0]
        edges = np.searchsorted(seconds, np.arange(0.0, seconds[-1] + WINDOW_S, WINDOW_S))
        edges = np.unique(np.minimum(edges, piece.size - 1))
        for begin, end in zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True):
            step = position[piece[end]] - position[piece[begin]]
            in_fixed, in_body = by_fixed[end] - by_fixed[begin], by_body[end] - by_body[begin]
            turn, told = yaw[piece[end]] - yaw[piece[begin]], turned[end] - turned[begin]
            yield _Window(
                (
                    float(np.linalg.norm(step)),
                    float(np.linalg.norm(in_fixed)),
                    float(np.linalg.norm(step - in_body)),
                    float(np.linalg.norm(step - in_fixed)),
                ),
                (abs(float(turn)), abs(float(told)), abs(float(turn - told))),
            )


def _integral(rates: Floats, seconds: Floats) -> Floats:
    """The trapezoid sum of rates (N, D) from the first sample to each, (N, D)."""
    steps = 0.5 * (rates[1:] + rates[:-1]) * np.diff(seconds)[:, None]
    return np.concatenate([np.zeros((1, rates.shape[1])), np.cumsum(steps, axis=0)])


def _constant(values: Floats) -> bool:
    """Whether nothing in a column ever changes; NaN throughout counts."""
    known = values[np.isfinite(values).reshape(values.shape[0], -1).all(axis=1)]
    return known.size == 0 or bool(np.all(np.ptp(known, axis=0) <= _CONSTANT))
