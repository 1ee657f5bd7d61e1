"""The success vector: closed forms, a slow reference, and what must hold for any recording."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from graspe_data.observation.labels.events import Event
from graspe_data.observation.labels.motion_series import OdometrySeries
from graspe_data.observation.labels.review import Decided
from graspe_data.observation.labels.trajectory_labels import (
    LabelSettings,
    LabelSource,
    RowLabels,
    label_rows,
)

Build = Callable[..., Any]
Times = list[tuple[float, float]]

SETTINGS = LabelSettings()
NOTHING = Decided()


def events(start_ns: int, times: Times) -> tuple[Event, ...]:
    return tuple(
        Event("other", start_ns + round(a * 1e9), start_ns + round(b * 1e9)) for a, b in times
    )


def label(odometry: OdometrySeries, anchor_s: float, decided: Decided = NOTHING) -> RowLabels:
    anchors = odometry.stamps_ns[:1] + round(anchor_s * 1e9)
    return label_rows(anchors, odometry, decided, SETTINGS)


def text(labels: RowLabels) -> str:
    """One row as 1, 0 and - (masked)."""
    return "".join(
        str(success) if judged else "-"
        for success, judged in zip(labels.success[0], labels.mask[0], strict=True)
    )


def test_driving_on_succeeds(drive: Build) -> None:
    labels = label(drive(0.5, 0.3), 2.0)
    assert text(labels) == "1111111111"
    assert set(labels.source[0]) == {LabelSource.RULE}
    assert [array.dtype.name for array in vars(labels).values()] == ["uint8", "bool", "uint8"]


def test_steps_fail_from_the_first_that_meets_a_failure(drive: Build, start_ns: int) -> None:
    failure = Decided(taken=events(start_ns, [(3.0, 3.1)]))
    labels = label(drive(0.5), 2.0, failure)
    assert text(labels) == "1110000000"
    assert labels.source[0].tolist() == [1, 1, 1] + [2] * 7


def test_a_step_holds_its_end_and_not_its_start(drive: Build, start_ns: int) -> None:
    at_end = Decided(confirmed=events(start_ns, [(2.3, 2.3)]))
    assert text(label(drive(0.5), 2.0, at_end)) == "0000000000"
    assert text(label(drive(0.5), 2.3, at_end)) == "1111111111"
    just_after = Decided(confirmed=events(start_ns, [(2.300000001, 2.4)]))
    assert text(label(drive(0.5), 2.0, just_after)) == "1000000000"


def test_a_failure_under_way_fails_the_first_step(drive: Build, start_ns: int) -> None:
    assert text(label(drive(0.0), 2.0, Decided(taken=events(start_ns, [(0, 9)])))) == "0000000000"


def test_a_path_that_leaves_the_arc_is_masked_from_there(drive: Build) -> None:
    # Straight at 1 m/s, from second 2 on turning at 1 rad/s; after t s of it the distance between
    # path and line is hypot(t - sin t, 1 - cos t), which passes 0.5 m at t = 1.03 s.
    turning = drive(1.0, lambda times: np.where(times > 2.0, 1.0, 0.0))
    assert text(label(turning, 1.5)) == "11111-----"
    assert text(label(turning, 3.0)) == "1111111111"


def test_a_failure_before_leaving_the_arc_is_judged(drive: Build, start_ns: int) -> None:
    stopped = drive(lambda times: np.where(times < 3.0, 1.0, 0.0))
    assert text(label(stopped, 2.0)) == "1111------"
    assert text(label(stopped, 2.0, Decided(taken=events(start_ns, [(3.0, 3.1)])))) == "1110000000"
    # A failure after the path has left the arc says nothing about the arc.
    assert text(label(stopped, 2.0, Decided(taken=events(start_ns, [(4.5, 5)])))) == "1111------"


def test_the_end_of_the_odometry_ends_the_judgement(drive: Build, start_ns: int) -> None:
    assert text(label(drive(0.5, seconds=4.0), 2.5)) == "11111-----"
    failure = Decided(taken=events(start_ns, [(3.0, 9.0)]))
    assert text(label(drive(0.5, seconds=4.0), 2.5, failure)) == "1000000000"
    assert text(label(drive(0.5), -0.1)) == "----------"
    assert text(label(drive(0.5), 10.1)) == "----------"


def test_a_gap_ends_the_judgement(drive: Build) -> None:
    whole = drive(0.5)
    keep = (whole.stamps_ns <= whole.stamps_ns[60]) | (whole.stamps_ns >= whole.stamps_ns[80])
    cut = OdometrySeries(*(value[keep] for value in vars(whole).values() if value is not None))
    assert text(label(cut, 2.4)) == "11--------"
    assert text(label(cut, 3.2)) == "----------"
    assert text(label(cut, 4.0)) == "1111111111"


def test_what_was_left_out_is_masked_from_its_start(drive: Build, start_ns: int) -> None:
    left_out = events(start_ns, [(3.0, 3.1)])
    labels = label(drive(0.5), 2.0, Decided(left_out=left_out))
    assert text(labels) == "111-------"
    assert labels.source[0].tolist() == [1, 1, 1] + [0] * 7
    earlier = events(start_ns, [(2.5, 2.5)])
    assert text(label(drive(0.5), 2.0, Decided(left_out=left_out, added=earlier))) == "1000000000"


def test_a_persons_word_is_the_source_where_it_decides(drive: Build, start_ns: int) -> None:
    rejected = Decided(rejected=events(start_ns, [(2.7, 2.8)]))
    assert label(drive(0.5), 2.0, rejected).source[0].tolist() == [1, 1, 3, 1, 1, 1, 1, 1, 1, 1]
    both = Decided(
        confirmed=events(start_ns, [(3.5, 4)]), taken=events(start_ns, [(2.8, 3), (4.5, 5)])
    )
    assert label(drive(0.5), 2.0, both).source[0].tolist() == [1, 1] + [2] * 8
    tie = Decided(confirmed=events(start_ns, [(2.8, 4)]), taken=events(start_ns, [(2.7, 3)]))
    assert label(drive(0.5), 2.0, tie).source[0].tolist() == [1, 1] + [3] * 8


def test_no_anchors_give_no_rows(drive: Build) -> None:
    labels = label_rows(np.zeros(0, np.int64), drive(0.5), NOTHING, SETTINGS)
    assert labels.success.shape == labels.mask.shape == labels.source.shape == (0, 10)


def reference(anchor: int, odometry: OdometrySeries, decided: Decided) -> str:
    """The definition, step by step."""
    dt = 300_000_000
    x0, y0, yaw0, v, omega = (float(value[0]) for value in odometry.at(np.array([anchor])))
    row = ""
    for k in range(10):
        after, until = anchor + k * dt, anchor + (k + 1) * dt

        def met(of: tuple[Event, ...], after: int = after, until: int = until) -> bool:
            return any(event.start_ns <= until and event.stop_ns > after for event in of)

        t = (k + 1) * 0.3
        turn = omega * t
        if abs(omega) > 1e-9:
            px, py = v / omega * np.sin(turn), v / omega * (1 - np.cos(turn))
        else:
            px, py = v * t, 0.0
        ex, ey = (float(value[0]) for value in odometry.at(np.array([until]))[:2])
        dx = x0 + np.cos(yaw0) * px - np.sin(yaw0) * py - ex
        dy = y0 + np.sin(yaw0) * px + np.cos(yaw0) * py - ey
        stamps = odometry.stamps_ns
        known = after >= stamps[0] and until <= stamps[-1]
        if "0" in row or (met(decided.taken + decided.by_person) and "-" not in row):
            row += "0"
        elif "-" in row or not known or met(decided.left_out) or np.hypot(dx, dy) > 0.5:
            row += "-"
        else:
            row += "1"
    return row


spans = st.lists(
    st.tuples(st.integers(0, 90), st.integers(0, 20)).map(
        lambda span: (span[0] / 10, sum(span) / 10)
    ),
    max_size=4,
)


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)
@given(
    taken=spans,
    added=spans,
    left_out=spans,
    speed=st.floats(0, 1.5),
    turn=st.floats(-1, 1),
    change=st.floats(0, 10),
)
def test_labels_are_those_of_the_definition_and_do_not_un_fail(
    *,
    drive: Build,
    start_ns: int,
    taken: Times,
    added: Times,
    left_out: Times,
    speed: float,
    turn: float,
    change: float,
) -> None:
    odometry = drive(speed, lambda times: np.where(times < change, turn, 0.3 * turn))
    decided = Decided(
        taken=events(start_ns, taken),
        added=events(start_ns, added),
        left_out=events(start_ns, left_out),
    )
    anchors = start_ns + np.arange(-1, 105, 7) * 100_000_000
    labels = label_rows(anchors, odometry, decided, SETTINGS)
    success, mask = labels.success.astype(int), labels.mask.astype(int)
    assert np.all(np.diff(success, axis=1) <= 0)
    assert np.all(np.diff(mask, axis=1) <= 0)
    assert np.all((labels.source == LabelSource.UNJUDGED) == ~labels.mask)
    assert not np.any(labels.success[~labels.mask])
    for row, anchor in enumerate(anchors):
        one = RowLabels(*(value[row : row + 1] for value in vars(labels).values()))
        assert text(one) == reference(int(anchor), odometry, decided)


@pytest.mark.parametrize("maximum", [0.1, 0.5, 2.0])
def test_a_wider_limit_judges_more(drive: Build, maximum: float) -> None:
    odometry = drive(lambda times: 1 + 0.5 * np.sin(times), np.cos)
    narrow, wide = (
        label_rows(
            odometry.stamps_ns, odometry, NOTHING, LabelSettings(maximum_deviation=limit)
        ).mask
        for limit in (maximum, 2 * maximum)
    )
    assert np.all(wide | ~narrow)
    assert wide.sum() > narrow.sum()
