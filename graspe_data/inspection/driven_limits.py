"""Limits of velocity by what was driven, where no manifest tells them."""

from __future__ import annotations

import numpy as np

from graspe_data.arrays import Floats
from graspe_data.robot import Limits
from graspe_data.synchronisation.motion_samples import MotionSamples, motion_samples
from graspe_data.synchronisation.tracks import MotionTrack


def driven_limits(track: MotionTrack) -> Limits:
    """So wide that what was driven fits, and leaps do not: half as much again as nearly always."""
    own = track.stamps.header_ns
    samples = motion_samples(track, track.stamps.bag_ns if own is None or not own.any() else own)
    fastest = 1.5 * _usual_speed(samples) + 0.5
    quickest = 1.5 * _usual_rate(samples) + 0.5
    return Limits(linear_velocity=(-fastest, fastest), yaw_rate=(-quickest, quickest))


def _usual_speed(samples: MotionSamples) -> float:
    told = np.linalg.norm(samples.linear, axis=1)
    return max(_high(told), _high(_per_second(samples, samples.position)))


def _usual_rate(samples: MotionSamples) -> float:
    heading = samples.yaw[:, None]
    return max(_high(np.abs(samples.angular[:, 2])), _high(_per_second(samples, heading)))


def _per_second(samples: MotionSamples, values: Floats) -> Floats:
    """How far values (N, D) go within a second, over that second."""
    seconds = (samples.stamps_ns - samples.stamps_ns[:1]) * 1e-9
    later = np.searchsorted(seconds, seconds + 1.0)
    begin = np.flatnonzero(later < seconds.size)
    if not begin.size:
        begin, later = np.array([0]), np.full(max(1, seconds.size), max(0, seconds.size - 1))
    span = np.maximum(seconds[later[begin]] - seconds[begin], 1e-3)
    return np.asarray(np.linalg.norm(values[later[begin]] - values[begin], axis=1) / span)


def _high(values: Floats) -> float:
    known = values[np.isfinite(values)]
    return float(np.percentile(known, 98)) if known.size else 0.0
