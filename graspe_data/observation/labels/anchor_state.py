"""What a robot is doing at the anchor of a row, and how long until it fails.

Odometry tells a failure that is under way without any sensor, so scores are looked at apart on rows
that are not failing yet.
"""

from __future__ import annotations

from enum import IntEnum
from typing import Final

import numpy as np
from numpy.typing import NDArray

from graspe_data.arrays import Floats, Indices, Mask, Stamps
from graspe_data.observation.labels.events import bounds_ns, touches
from graspe_data.observation.labels.review import Decided


class AnchorState(IntEnum):
    """What holds at an anchor; the first that fits."""

    FAILING = 0
    STANDING = 1
    BACKING = 2
    DRIVING = 3


STANDING_SPEED: Final = 0.05
"""m/s; below it a robot that hardly turns stands, and one that goes back faster than it backs."""
STANDING_YAW_RATE: Final = 0.1
"""rad/s; a robot that turns faster on the spot is driving."""


def failing_by_events(anchors_ns: Stamps, decided: Decided) -> Mask:
    """Whether a failure is under way at each anchor, bool (R,).

    That is one whose closed interval holds the anchor: stated by a person, taken from a rule, or
    left out for want of a review, for it may be one. A failure that begins later, be it within the
    first step, is not under way; one that has ended is not either.

    Args:
        anchors_ns: int64 (R,), ns.
        decided: The recording's failures.
    """
    failures = (*decided.by_person, *decided.taken, *decided.left_out)
    return touches(*bounds_ns(failures), anchors_ns - 1, anchors_ns)


def anchor_states(failing: Mask, velocity: Floats) -> NDArray[np.uint8]:
    """The state at each anchor, uint8 (R,), an :class:`AnchorState`.

    Args:
        failing: bool (R,), whether a failure is under way there.
        velocity: (R, 2), m/s along body x and rad/s, measured at the anchor.
    """
    v, omega = velocity[:, 0], velocity[:, 1]
    states = np.select(
        [
            failing,
            (np.abs(v) < STANDING_SPEED) & (np.abs(omega) < STANDING_YAW_RATE),
            v <= -STANDING_SPEED,
        ],
        [AnchorState.FAILING, AnchorState.STANDING, AnchorState.BACKING],
        AnchorState.DRIVING,
    )
    return states.astype(np.uint8)


def failing_by_labels(
    stamps_ns: Stamps, recording: Indices, success: Mask, mask: Mask, step_ns: int
) -> Mask:
    """Whether a failure is under way at each anchor, as far as labels alone tell, bool (R,).

    For datasets without the column ``state``. A failure may be under way where the first step is
    judged and fails. It is not where an earlier row of the recording judged the step that holds
    this anchor, and that step succeeds. So of rows whose failure begins within the first step those
    that no earlier row speaks for count as failing.

    Args:
        stamps_ns: int64 (R,), the anchors.
        recording: int64 (R,), which recording each row is of.
        success: bool (R, T).
        mask: bool (R, T), whether the step is judged.
        step_ns: Length of a step: step k covers (anchor + k step, anchor + (k + 1) step].
    """
    failing: Mask = mask[:, 0] & ~success[:, 0]
    judged_well = mask & success
    for number in np.unique(recording[failing]):
        rows = np.flatnonzero(recording == number)
        held = _held(stamps_ns[rows], judged_well[rows], step_ns)
        failing[rows] &= ~held
    return failing


def _held(stamps: Stamps, judged_well: Mask, step_ns: int) -> Mask:
    """Whether each stamp lies in a step that some row judged to succeed."""
    row, step = np.nonzero(judged_well)
    after = stamps[row] + step * step_ns
    # Over stamps in order a span (after, after + step] adds one at its begin, takes it at its end.
    order = np.argsort(stamps, kind="stable")
    changes = np.zeros(stamps.size + 1, np.int64)
    np.add.at(changes, np.searchsorted(stamps[order], after, side="right"), 1)
    np.add.at(changes, np.searchsorted(stamps[order], after + step_ns, side="right"), -1)
    held = np.zeros(stamps.size, np.bool_)
    held[order] = np.cumsum(changes[:-1]) > 0
    return held


def steps_to_failure(success: Mask, mask: Mask) -> Indices:
    """The first judged step that fails, int64 (R,), from 0; T where none does.

    Times the length of a step that is the time until the failure, rounded down to whole steps; 0
    for a failure that is under way.

    Args:
        success: bool (R, T).
        mask: bool (R, T), whether the step is judged.
    """
    fails = mask & ~success
    first: Indices = fails.argmax(axis=1).astype(np.int64)
    first[~fails.any(axis=1)] = success.shape[1]
    return first
