"""Which picture, cloud and odometry make a row: anchors, ages, and why an anchor makes none."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from graspe_data.arrays import Indices, Mask, Stamps
from graspe_data.manifest import Positive
from graspe_data.observation.odometry_series import (
    PoseSamples,
    PoseSeries,
    history_times,
    sample_odometry,
    velocity_history,
)
from graspe_data.observation.settings import HistorySettings
from graspe_data.synchronisation.clocks import SECOND


class WindowSettings(HistorySettings):
    """Which moments of a recording make a row: rate, Hz, history and tolerances."""

    anchor_rate: Positive = 10.0
    points_required: bool = True
    """False keeps rows without a cloud, marked ``points_valid = False``."""


class SynchronisationSettings(WindowSettings):
    """The window, and how far ahead odometry has to reach."""

    horizon_s: Positive = 3.0


@dataclass(frozen=True)
class RowPlan:
    """The rows of a recording, R of them, in time order.

    ``anchor_ns`` (R,); ``image`` and ``points`` (R,) are the ordinals of the messages on their
    topics, ``points`` -1 where there is no cloud; ``points_age_ns`` (R,) is positive for a cloud
    older than the picture; ``now`` is the odometry at the anchor (R,), ``history`` float32
    (R, H, 2) the velocities up to it, m/s and rad/s, oldest first. ``lost`` counts the anchors
    that made no row, by reason.
    """

    anchor_ns: Stamps
    image: Indices
    points: Indices
    points_age_ns: Stamps
    now: PoseSamples
    history: NDArray[np.float32]
    lost: Mapping[str, int]

    @property
    def rows(self) -> int:
        """How many rows."""
        return int(self.anchor_ns.size)


def pair_nearest(stamps_ns: Stamps, others_ns: Stamps, tolerance_s: float) -> Indices:
    """For each stamp (N,), the index of the nearest other stamp, -1 beyond the tolerance.

    Of two at the same distance the older one is taken: it was known at that moment.
    """
    order = np.argsort(others_ns, kind="stable")
    ordered = others_ns[order]
    right = np.clip(np.searchsorted(ordered, stamps_ns, side="left"), 0, ordered.size - 1)
    left = np.maximum(right - 1, 0)
    nearer_left = np.abs(stamps_ns - ordered[left]) <= np.abs(ordered[right] - stamps_ns)
    nearest = np.where(nearer_left, left, right)
    within = np.abs(ordered[nearest] - stamps_ns) <= round(tolerance_s * SECOND)
    return np.where(within, order[nearest], -1)


def choose_anchors(stamps_ns: Stamps, rate: float) -> Indices:
    """Indices of the stamps kept at a rate, in time order.

    The first stamp begins a schedule of one anchor a period. A stamp is kept when it reaches its
    time in the schedule, or misses it by less than half the topic's own interval; after a pause the
    schedule begins anew. Repeated stamps are kept once.
    """
    order = np.argsort(stamps_ns, kind="stable")
    ordered = stamps_ns[order]
    intervals = np.diff(ordered)
    # A picture counts that comes at most half an interval before it is due.
    typical = float(np.median(intervals[intervals > 0])) if np.any(intervals > 0) else 0.0
    period = SECOND / rate
    early = min(0.5 * typical, 0.5 * period)
    # Due times go on by the period, and begin anew after a gap.
    kept: list[int] = []
    due, last = float(ordered[0]), None
    for position, stamp in enumerate(ordered.tolist()):
        if stamp < due - early or stamp == last:
            continue
        kept.append(position)
        last = stamp
        due = due + period if stamp < due + period else stamp + period
    return order[np.array(kept, np.int64)]


def plan_rows(
    image_ns: Stamps,
    points_ns: Stamps,
    odometry: PoseSeries,
    settings: SynchronisationSettings,
    placed: Mask | None = None,
) -> RowPlan:
    """Decide the rows of a recording.

    Args:
        image_ns: Stamps of the pictures in the reader's order, int64 ns, shape (I,), I > 0.
        points_ns: Stamps of the clouds in the reader's order, int64 ns, shape (C,), C > 0.
        odometry: The odometry on the same clock.
        settings: Rates, windows, tolerances.
        placed: Which clouds (C,) can be brought into the base frame; None for all.

    Returns:
        The plan; every anchor without a row is counted under the first reason that applies.
    """
    image = choose_anchors(image_ns, settings.anchor_rate)
    anchors = image_ns[image]
    points = pair_nearest(anchors, points_ns, settings.points_tolerance_s)
    times = history_times(anchors, settings.history_steps, settings.history_step_s)
    now = sample_odometry(odometry, anchors, settings.odometry_gap_s)
    history, known = velocity_history(odometry, times, settings.odometry_gap_s)
    end_ns = anchors + round(settings.horizon_s * SECOND)
    reasons = {
        "history begins before the odometry": times[:, 0] < odometry.stamps_ns[0],
        "horizon runs past the end of the odometry": end_ns > odometry.stamps_ns[-1],
        "gap in the odometry of the history": ~(known & now.known),
        "no cloud within the tolerance": (points < 0) & settings.points_required,
        "no transform of the cloud at its stamp": (points >= 0) & ~_all(placed, points_ns)[points],
    }
    lost, keep = _count_losses(reasons, anchors.size)
    age = np.where(points >= 0, anchors - points_ns[points], 0)
    return RowPlan(
        anchors[keep],
        image[keep],
        points[keep],
        age[keep],
        _take(now, keep),
        history[keep],
        lost,
    )


def join_plans(plans: Sequence[RowPlan]) -> RowPlan:
    """The rows of several stretches, one after another."""
    if len(plans) == 1:
        return plans[0]
    parts = [plan.now for plan in plans]
    now = PoseSamples(
        np.concatenate([part.pose for part in parts]),
        np.concatenate([part.velocity for part in parts]),
        np.concatenate([part.known for part in parts]),
        np.concatenate([part.age_ns for part in parts]),
    )
    return RowPlan(
        np.concatenate([plan.anchor_ns for plan in plans]),
        np.concatenate([plan.image for plan in plans]),
        np.concatenate([plan.points for plan in plans]),
        np.concatenate([plan.points_age_ns for plan in plans]),
        now,
        np.concatenate([plan.history for plan in plans]),
        dict(sum((Counter(plan.lost) for plan in plans), Counter[str]())),
    )


def lost_rows(image_ns: Stamps, settings: SynchronisationSettings, reason: str) -> RowPlan:
    """The plan of pictures (I,) that make no row, for one reason."""
    none = np.empty(0, np.int64)
    anchors = choose_anchors(image_ns, settings.anchor_rate).size if image_ns.size else 0
    now = PoseSamples(np.empty((0, 6)), np.empty((0, 2)), np.empty(0, np.bool_), none)
    history = np.empty((0, settings.history_steps, 2), np.float32)
    return RowPlan(none, none, none, none, now, history, {reason: anchors} if anchors else {})


def _all(placed: Mask | None, points_ns: Stamps) -> Mask:
    return np.ones(points_ns.size, np.bool_) if placed is None else placed


def _count_losses(
    reasons: Mapping[str, NDArray[np.bool_]], rows: int
) -> tuple[dict[str, int], NDArray[np.bool_]]:
    keep, lost = np.ones(rows, np.bool_), Counter[str]()
    for reason, applies in reasons.items():
        lost[reason] += int(np.count_nonzero(keep & applies))
        keep &= ~applies
    return {reason: count for reason, count in lost.items() if count}, keep


def _take(samples: PoseSamples, keep: NDArray[np.bool_]) -> PoseSamples:
    return PoseSamples(
        samples.pose[keep], samples.velocity[keep], samples.known[keep], samples.age_ns[keep]
    )
