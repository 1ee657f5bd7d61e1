"""Odometry between its samples, never across a gap; and the velocities before a moment."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from graspe_data.arrays import Floats, Stamps
from graspe_data.errors import ObservationError
from graspe_data.geometry import roll_pitch_yaw, rotation_from_quaternion

_SECOND = 1_000_000_000


@dataclass(frozen=True)
class PoseSeries:
    """Odometry in time order, one sample a stamp.

    ``pose`` (N, 6): x, y, z in metres and roll, pitch, yaw in rad, in the odometry frame; angles
    unwrapped. ``velocity`` (N, 2): m/s along body x, and rad/s. Between samples of two segments
    (``segment``, int64 (N,)) the robot was set elsewhere: nothing is interpolated across. One
    segment where the field is left empty.
    """

    stamps_ns: Stamps
    pose: Floats
    velocity: Floats
    segment: Stamps = field(default_factory=lambda: np.empty(0, np.int64))


@dataclass(frozen=True)
class PoseSamples:
    """Odometry at asked times (...,): pose (..., 6), velocity (..., 2), and what is behind them.

    ``known`` is False outside the series and inside a gap; ``age_ns`` is the time since the
    latest sample at or before the asked time.
    """

    pose: Floats
    velocity: Floats
    known: NDArray[np.bool_]
    age_ns: Stamps


def odometry_series(
    stamps_ns: Stamps,
    position: Floats,
    rotation: Floats,
    velocity: Floats,
    segment: Stamps | None = None,
) -> PoseSeries:
    """Sort samples by time, drop repeated stamps and samples that are not finite.

    Samples without any pose (all NaN) are integrated from the origin along their arcs.

    Args:
        stamps_ns: int64 (N,), ns.
        position: (N, 3), metres, odometry frame.
        rotation: (N, 3, 3) of the body in that frame; or quaternions (N, 4), x, y, z, w.
        velocity: (N, 2), m/s and rad/s, body frame.
        segment: int64 (N,); None for one segment.

    Raises:
        ObservationError: Fewer than two usable samples.
    """
    # One sample a stamp; poses as they are, or the twist integrated where there are none.
    stamps, first = np.unique(stamps_ns, return_index=True)
    speeds = velocity[first]
    if np.isnan(position).all():
        pose = _dead_reckoning(stamps, speeds)
    else:
        pose = _poses(position[first], rotation[first])
    # What has no number is left out; angles run on past pi.
    usable = np.isfinite(pose).all(axis=1) & np.isfinite(speeds).all(axis=1)
    if np.count_nonzero(usable) < 2:  # noqa: PLR2004
        raise ObservationError(
            f"{np.count_nonzero(usable)} usable odometry samples of {usable.size}; at least two "
            "are needed."
        )
    pose, speeds = pose[usable], speeds[usable]
    pose[:, 3:] = np.unwrap(pose[:, 3:], axis=0)
    parts = np.zeros(stamps.size, np.int64) if segment is None else segment[first]
    return PoseSeries(stamps[usable], pose, speeds, parts[usable])


def sample_odometry(series: PoseSeries, times_ns: Stamps, maximum_gap_s: float) -> PoseSamples:
    """Interpolate linearly between neighbouring samples no further apart than ``maximum_gap_s``."""
    stamps = series.stamps_ns
    before = np.searchsorted(stamps, times_ns, side="right") - 1
    left = np.clip(before, 0, stamps.size - 2)
    span = stamps[left + 1] - stamps[left]
    share = (times_ns - stamps[left]) / span
    exact = (times_ns == stamps[left]) | (times_ns == stamps[left + 1])
    inside = (times_ns >= stamps[0]) & (times_ns <= stamps[-1])
    joined = span <= round(maximum_gap_s * _SECOND)
    if series.segment.size:
        joined &= series.segment[left] == series.segment[left + 1]
    known = exact | (inside & joined)
    return PoseSamples(
        pose=_blend(series.pose, left, share),
        velocity=_blend(series.velocity, left, share),
        known=known,
        age_ns=times_ns - stamps[np.maximum(before, 0)],
    )


def _blend(values: Floats, left: NDArray[np.intp], share: Floats) -> Floats:
    weight = share[..., None]
    blended: Floats = (1.0 - weight) * values[left] + weight * values[left + 1]
    return blended


def _poses(position: Floats, rotation: Floats) -> Floats:
    if rotation.ndim == 2:  # noqa: PLR2004 - quaternions
        length = np.linalg.norm(rotation, axis=1)
        turned = np.full((length.size, 3, 3), np.nan)
        sound = length > 0
        turned[sound] = rotation_from_quaternion(rotation[sound])
        rotation = turned
    return np.concatenate([position, np.stack(roll_pitch_yaw(rotation), axis=1)], axis=1)


def _dead_reckoning(stamps: Stamps, velocity: Floats) -> Floats:
    step = np.diff(stamps) / _SECOND
    middle = 0.5 * (velocity[1:] + velocity[:-1])
    yaw = np.concatenate([[0.0], np.cumsum(middle[:, 1] * step)])
    heading = 0.5 * (yaw[1:] + yaw[:-1])
    pose = np.zeros((stamps.size, 6))
    pose[1:, 0] = np.cumsum(middle[:, 0] * step * np.cos(heading))
    pose[1:, 1] = np.cumsum(middle[:, 0] * step * np.sin(heading))
    pose[:, 5] = yaw
    return pose


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
