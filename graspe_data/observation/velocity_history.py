"""The velocities that led up to a moment."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from graspe_data.arrays import Stamps
from graspe_data.observation.odometry_series import PoseSeries, sample_odometry

_SECOND = 1_000_000_000


def history_times(anchors_ns: Stamps, steps: int, step_s: float) -> Stamps:
    """The moments of the history, int64 ns (R, steps), oldest first and the anchor (R,) last."""
    back_s = np.arange(steps - 1, -1, -1) * step_s
    return np.asarray(anchors_ns[:, None] - np.rint(back_s * _SECOND).astype(np.int64))


def velocity_history(
    odometry: PoseSeries, times_ns: Stamps, maximum_gap_s: float
) -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
    """Velocities at the moments of a history.

    Args:
        odometry: The odometry, on the clock of the moments.
        times_ns: int64 (R, H), see ``history_times``.
        maximum_gap_s: Two samples further apart than this are not interpolated between, s.

    Returns:
        float32 (R, H, 2), m/s and rad/s; and bool (R,), whether all of it is known.
    """
    history = np.empty((*times_ns.shape, 2), np.float32)
    known = np.empty(times_ns.shape, np.bool_)
    # One slice of the shorter axis at a time, so that little else is in memory.
    rows = len(times_ns) < times_ns.shape[1]
    parts = ((part, ...) if rows else (..., part) for part in range(min(times_ns.shape)))
    for part in parts:
        samples = sample_odometry(odometry, times_ns[part], maximum_gap_s)
        known[part] = samples.known
        for component in range(2):
            history[..., component][part] = samples.velocity[:, component]
    return history, np.asarray(known.all(axis=1))
