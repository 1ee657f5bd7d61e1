"""The state at an anchor: by events, and by labels alone where a dataset has no column of it."""

from __future__ import annotations

from typing import Any

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from graspe_data.observation.labels.anchor_state import (
    AnchorState,
    anchor_states,
    failing_by_events,
    failing_by_labels,
    steps_to_failure,
)
from graspe_data.observation.labels.events import Event
from graspe_data.observation.labels.motion_series import OdometrySeries
from graspe_data.observation.labels.review import Decided
from graspe_data.observation.labels.trajectory_labels import LabelSettings, label_rows

SECOND = 1_000_000_000


def event(start: float, stop: float) -> Event:
    return Event("stuck", round(start * SECOND), round(stop * SECOND))


def states(*velocities: tuple[float, float], failing: bool = False) -> list[AnchorState]:
    found = anchor_states(np.full(len(velocities), failing), np.array(velocities))
    return [AnchorState(state) for state in found]


def test_a_failure_is_under_way_from_its_first_to_its_last_instant() -> None:
    anchors = np.array([1.9, 2.0, 2.5, 3.0, 3.1]) * SECOND
    found = failing_by_events(anchors.astype(np.int64), Decided(taken=(event(2, 3),)))
    assert found.tolist() == [False, True, True, True, False]


def test_a_failure_within_the_first_step_is_not_under_way() -> None:
    soon = Decided(confirmed=(event(2.1, 5),))
    assert not failing_by_events(np.array([2 * SECOND]), soon).any()


def test_what_nobody_reviewed_may_be_a_failure_and_what_was_rejected_is_none() -> None:
    anchor = np.array([2 * SECOND])
    assert failing_by_events(anchor, Decided(left_out=(event(1, 3),))).all()
    assert failing_by_events(anchor, Decided(added=(event(2, 2),))).all()
    assert not failing_by_events(anchor, Decided(rejected=(event(1, 3),))).any()
    assert not failing_by_events(anchor, Decided()).any()


def test_odometry_tells_standing_backing_and_driving() -> None:
    found = states((0.0, 0.0), (0.04, -0.09), (-0.05, 0.0), (-0.4, 1.0), (0.0, 0.5), (0.05, 0.0))
    standing, backing, driving = AnchorState.STANDING, AnchorState.BACKING, AnchorState.DRIVING
    assert found == [standing, standing, backing, backing, driving, driving]


def test_failing_comes_before_what_odometry_says() -> None:
    assert set(states((0.0, 0.0), (-1.0, 0.0), (1.0, 0.0), failing=True)) == {AnchorState.FAILING}


def test_an_earlier_row_speaks_for_an_anchor_before_the_failure() -> None:
    # The failure begins 0.1 s after the second anchor: its first step fails, and it has not begun.
    stamps = np.array([0, SECOND, 2 * SECOND])
    success = np.array([[1, 1, 1, 0], [0, 0, 0, 0], [0, 0, 0, 0]], bool)
    found = failing_by_labels(stamps, np.zeros(3, np.int64), success, success | True, SECOND // 2)
    assert found.tolist() == [False, False, True]


def test_a_row_of_another_recording_speaks_for_none() -> None:
    stamps, success = np.array([0, SECOND]), np.array([[1, 1], [0, 0]], bool)
    for recording, under_way in (([0, 0], False), ([0, 1], True)):
        found = failing_by_labels(stamps, np.array(recording), success, success | True, SECOND)
        assert found.tolist() == [False, under_way]


def test_a_first_step_that_nobody_judged_is_not_failing() -> None:
    none = np.zeros((1, 2), bool)
    assert not failing_by_labels(np.zeros(1, np.int64), np.zeros(1, np.int64), none, none, 1).any()


@given(
    starts=st.lists(st.integers(0, 90), max_size=3),
    length=st.integers(0, 20),
    order=st.randoms(use_true_random=False),
)
def test_labels_miss_no_failure_that_is_under_way(
    starts: list[int], length: int, order: Any
) -> None:
    """Whoever fails by events and is judged, fails by labels; those too many begin at once."""
    failures = tuple(event(start / 10, (start + length) / 10) for start in starts)
    anchors = np.array(order.sample(range(80), 40)) * SECOND // 10
    decided, stamps = Decided(taken=failures), np.arange(130) * SECOND // 10
    odometry = _still(stamps)
    labels = label_rows(anchors, odometry, decided, LabelSettings())
    by_events = failing_by_events(anchors, decided)
    one = np.zeros(anchors.size, np.int64)
    success = labels.success.astype(bool)
    by_labels = failing_by_labels(anchors, one, success, labels.mask, 300_000_000)
    first_fails = ~success[:, 0]
    assert not (by_events & first_fails & ~by_labels).any()
    begins_later = by_labels & ~by_events
    assert (steps_to_failure(success, labels.mask)[begins_later] == 0).all()


def _still(stamps: Any) -> OdometrySeries:
    zero = np.zeros(stamps.size)
    return OdometrySeries(stamps, zero, zero, zero, zero, zero)


def test_steps_to_failure_counts_judged_steps() -> None:
    success = np.array([[1, 1, 0, 0], [1, 1, 1, 1], [0, 0, 0, 0], [1, 0, 0, 0]], bool)
    mask = np.ones((4, 4), bool)
    mask[3, 1:] = False
    assert steps_to_failure(success, mask).tolist() == [2, 4, 0, 4]
