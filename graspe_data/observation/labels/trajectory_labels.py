"""The success vector of every row: does the predicted trajectory succeed, step by step."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from graspe_data.arrays import Floats, Mask, Stamps
from graspe_data.manifest import Positive, Settings
from graspe_data.observation.labels.events import bounds_ns, touches
from graspe_data.observation.labels.motion_series import OdometrySeries
from graspe_data.observation.labels.review import Decided
from graspe_data.observation.trajectory import constant_velocity_arc


class LabelSource(IntEnum):
    """Who says what a step's label says."""

    UNJUDGED = 0
    RULE = 1
    UNREVIEWED_PROPOSAL = 2
    PERSON = 3


class LabelSettings(Settings):
    """Horizon and limits of the labels."""

    steps: Annotated[int, Field(ge=1, le=1000)] = 10
    step_s: Positive = 0.3
    maximum_deviation: Positive = 0.5
    """Metres between the driven path and the predicted arc, at equal times."""
    maximum_gap_s: Positive = 0.5
    """Between odometry samples; in a longer gap nothing is judged."""


@dataclass(frozen=True)
class RowLabels:
    """The labels of R rows over T steps, each (R, T).

    ``success``: uint8, 1 = success. ``mask``: bool, true where the step is judged; the judged
    steps of a row come first, and where it is false ``success`` is 0 and means nothing.
    ``source``: uint8, a ``LabelSource``.
    """

    success: NDArray[np.uint8]
    mask: NDArray[np.bool_]
    source: NDArray[np.uint8]


def label_rows(
    anchors_ns: NDArray[np.int64],
    odometry: OdometrySeries,
    decided: Decided,
    settings: LabelSettings,
) -> RowLabels:
    """Label the steps of the constant-velocity arc of every anchor (E_t of GrASPE).

    Step k covers the time (anchor + k step, anchor + (k + 1) step]. It fails when it meets a
    failure, and so do all steps after it. From the first step on that the recording cannot judge,
    steps are masked, unless a failure has begun by then: where the odometry has a gap or does not
    reach, where an event was left out for want of a review, or where the driven path is further
    than the maximum deviation from the arc.

    Args:
        anchors_ns: int64 (R,), ns.
        odometry: Gives velocity and pose at the anchors, and the driven path.
        decided: The failures.
        settings: Horizon and limits.
    """
    step_ns = round(settings.step_s * 1e9)
    edges = anchors_ns[:, None] + step_ns * np.arange(settings.steps + 1, dtype=np.int64)
    after, until = edges[:, :-1], edges[:, 1:]
    by_person = _from_first(touches(*bounds_ns(decided.by_person), after, until))
    by_rule = _from_first(touches(*bounds_ns(decided.taken), after, until))
    failed = by_person | by_rule
    doubtful = touches(*bounds_ns(decided.left_out), after, until)
    doubtful |= touches(*_gaps(odometry, settings.maximum_gap_s), after, until)
    doubtful |= _deviation(edges, odometry, settings) > settings.maximum_deviation
    mask = ~_from_first(doubtful & ~failed)
    cleared = touches(*bounds_ns(decided.rejected), after, until)
    # The failure that came first decides the source; a person's word counts for more at a tie.
    person_first = by_person & ~_from_first(by_rule & ~by_person)
    source = np.select(
        [~mask, person_first | (cleared & ~failed), failed],
        [LabelSource.UNJUDGED, LabelSource.PERSON, LabelSource.UNREVIEWED_PROPOSAL],
        LabelSource.RULE,
    )
    return RowLabels((mask & ~failed).astype(np.uint8), mask, source.astype(np.uint8))


def _from_first(mask: Mask) -> Mask:
    """True from a row's first true step on."""
    return np.logical_or.accumulate(mask, axis=1)


def _gaps(odometry: OdometrySeries, maximum_gap_s: float) -> tuple[Stamps, Stamps]:
    """The times without odometry, those before the first and after the last sample included.

    A gap begins a nanosecond after the sample before it: up to there the path is known. Where the
    poses do not go on there is one, however short.
    """
    stamps = odometry.stamps_ns
    apart = np.diff(stamps) > round(maximum_gap_s * 1e9)
    if odometry.segment is not None:
        apart |= np.diff(odometry.segment) != 0
    begins = np.flatnonzero(apart)
    limits = np.iinfo(np.int64)
    starts = np.concatenate([[limits.min], stamps[begins] + 1, stamps[-1:] + 1])
    return starts, np.concatenate([stamps[:1], stamps[begins + 1], [limits.max]])


def _deviation(edges: Stamps, odometry: OdometrySeries, settings: LabelSettings) -> Floats:
    """Distance (R, T) of the driven path from the predicted arc at the end of every step."""
    x, y, yaw, v, omega = odometry.at(edges)
    along, across = x - x[:, :1], y - y[:, :1]
    cosine, sine = np.cos(yaw[:, :1]), np.sin(yaw[:, :1])
    forward, left = cosine * along + sine * across, cosine * across - sine * along
    arc = constant_velocity_arc(v[:, 0], omega[:, 0], settings.steps, settings.step_s)
    distance: Floats = np.hypot(forward - arc[..., 0], left - arc[..., 1])[:, 1:]
    return distance
