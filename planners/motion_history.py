"""The velocity history of a situation."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from graspe_data.errors import PlannerError
from graspe_data.observation.odometry_series import (
    PoseSeries,
    history_times,
    odometry_series,
    velocity_history,
)
from graspe_data.observation.settings import HistorySettings
from graspe_data.sensor_data import Motion
from planners.situation import Situation

_NAN = float("nan")


def motion_history(
    situation: Situation, moment_ns: int, settings: HistorySettings
) -> NDArray[np.float32]:
    """Velocities up to a moment, float32 (H, 2), m/s and rad/s, oldest first.

    Where the moment is later than the latest motion, the velocity that the situation states for
    now stands at the end of the motions.

    Args:
        situation: Its motions carry velocities.
        moment_ns: The last of the history, ns.
        settings: Steps, their length, and the longest gap.

    Raises:
        PlannerError: The motions begin too late, end too early, have a gap, or no velocities.
        ObservationError: Fewer than two motions are usable.
    """
    times = history_times(
        np.array([moment_ns], np.int64), settings.history_steps, settings.history_step_s
    )
    history, is_known = velocity_history(
        _series(situation, moment_ns), times, settings.odometry_gap_s
    )
    if not is_known[0]:
        raise PlannerError(_uncovered(situation, int(times[0, 0]), moment_ns, settings))
    return np.asarray(history[0], np.float32)


def _series(situation: Situation, moment_ns: int) -> PoseSeries:
    rows = [(motion.stamp_ns, *_row(motion)) for motion in situation.motions]
    stamped = [row for row in rows if row[0] is not None]
    # Columns: position (3), quaternion (4), linear velocity and yaw rate (2).
    stamps = np.array([row[0] for row in stamped], np.int64)
    values = np.array([row[1:] for row in stamped], np.float64).reshape(-1, 9)
    # The velocity of now stands behind the latest motion.
    if stamps.size and stamps.max() < min(moment_ns, situation.now_ns):
        latest = values[int(stamps.argmax())].copy()
        latest[7:] = situation.velocity
        stamps = np.append(stamps, situation.now_ns)
        values = np.vstack((values, latest))
    return odometry_series(stamps, values[:, :3], values[:, 3:7], values[:, 7:])


def _row(motion: Motion) -> tuple[float, ...]:
    return (
        *(motion.position or (_NAN,) * 3),
        *(motion.quaternion or (_NAN,) * 4),
        _NAN if motion.linear_velocity is None else motion.linear_velocity,
        _NAN if motion.yaw_rate is None else motion.yaw_rate,
    )


def _uncovered(
    situation: Situation, first_ns: int, moment_ns: int, settings: HistorySettings
) -> str:
    stamps = [motion.stamp_ns for motion in situation.motions if motion.stamp_ns is not None]
    begin, end = ((stamp - moment_ns) / 1e9 for stamp in (min(stamps), max(stamps)))
    return (
        f"the motions reach from {begin:+.2f} s to {end:+.2f} s around the picture; the velocity "
        f"history needs {(first_ns - moment_ns) / 1e9:+.2f} s to 0, without a gap longer than "
        f"{settings.odometry_gap_s:g} s."
    )
