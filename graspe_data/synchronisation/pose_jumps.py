"""Where poses leap: resets and relocalisations cut a series, spikes are left out of it."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from graspe_data.arrays import Floats, Mask, Stamps
from graspe_data.robot import Limits
from graspe_data.synchronisation.differentiate import fresh
from graspe_data.synchronisation.motion_samples import SECOND, MotionSamples
from graspe_data.synchronisation.rotation_steps import turns_in_fixed

_SLACK_M, _SLACK_RAD = 0.05, 0.05
_LONGEST_SPIKE: Final = 3
_LONGEST_SPIKE_S: Final = 0.5
_PAIR: Final = 2


def cut_at_jumps(samples: MotionSamples, limits: Limits) -> MotionSamples:
    """Begin a new segment where a pose leaps further than the robot can go, and drop spikes.

    A leap is more than twice the limits allow in the time since the pose last changed, and 5 cm or
    0.05 rad besides. Up to three poses between two leaps are a spike where those before and after
    it lie within reach of each other.
    """
    if samples.stamps_ns.size < _PAIR or not np.isfinite(samples.position).any():
        return samples
    # Steps between poses that are new, faster than the robot can be.
    shown = np.flatnonzero(fresh(samples.stamps_ns, samples.position, samples.rotation))
    stamps = samples.stamps_ns[shown]
    position, rotation = samples.position[shown], samples.rotation[shown]
    leaps = leaping(stamps, position, rotation, limits)
    # A leap that is taken back is a spike: its poses go, the rest goes on.
    spikes = _spikes(np.flatnonzero(leaps) + 1, (stamps, position, rotation), limits)
    spans = [_way(stamps, position, begin) for begin, _ in spikes]
    kept = np.ones(samples.stamps_ns.size, np.bool_)
    for begin, end in spikes:
        leaps[[begin - 1, end - 1]] = False
        kept[shown[begin] : shown[end]] = False
    # Any other leap begins a new segment.
    starts = np.zeros(samples.stamps_ns.size, np.int64)
    starts[shown[np.flatnonzero(leaps) + 1]] = 1
    cut = replace(samples, segment=np.cumsum(starts), spikes=np.array(spans).reshape(-1, 2))
    return cut.only(kept)


def leaping(stamps_ns: Stamps, position: Floats, rotation: Floats, limits: Limits) -> Mask:
    """Whether the next pose is out of reach from each of N poses but the last, bool (N - 1,)."""
    seconds = np.diff(stamps_ns) / SECOND
    fastest = 2 * max(map(abs, limits.linear_velocity))
    quickest = 2 * max(map(abs, limits.yaw_rate))
    way = np.linalg.norm(np.diff(position, axis=0), axis=1)
    turn = np.linalg.norm(turns_in_fixed(rotation), axis=1)
    with np.errstate(invalid="ignore"):
        far = (way > fastest * seconds + _SLACK_M) | (turn > quickest * seconds + _SLACK_RAD)
    return np.asarray(far)


def _spikes(
    after_leaps: NDArray[np.intp], poses: tuple[Stamps, Floats, Floats], limits: Limits
) -> list[tuple[int, int]]:
    """The places [begin, end) of spikes, each between two leaps."""
    stamps, position, rotation = poses
    found: list[tuple[int, int]] = []
    indices = after_leaps.tolist()
    k = 0
    while k + 1 < len(indices):
        begin, end = indices[k], indices[k + 1]
        around = [begin - 1, end]
        short = end - begin <= _LONGEST_SPIKE
        near = stamps[end] - stamps[begin - 1] <= round(_LONGEST_SPIKE_S * SECOND)
        if short and near:
            ends = stamps[around], position[around], rotation[around]
            if not leaping(*ends, limits)[0]:
                found.append((begin, end))
                k += 1
        k += 1
    return found


def _way(stamps: Stamps, position: Floats, behind: int) -> tuple[float, float]:
    step = position[behind] - position[behind - 1]
    return float(np.linalg.norm(step)), float(stamps[behind] - stamps[behind - 1]) / SECOND
