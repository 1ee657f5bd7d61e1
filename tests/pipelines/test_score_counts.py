"""Scores of the label rules: counts of what was proposed, what was true, and what was both."""

from __future__ import annotations

import numpy as np
import pytest

from graspe_data.observation.labels import Event, EventKind, RowLabels
from pipelines.score_counts import EventScore, StepScore, score_events, score_steps


def event(start_s: float, stop_s: float, kind: EventKind = "stuck") -> Event:
    return Event(kind, round(start_s * 1e9), round(stop_s * 1e9))


def test_events_match_that_share_an_instant() -> None:
    proposed = [event(1, 3), event(10, 11), event(20, 21)]
    true = [event(2, 5), event(20.5, 20.6), event(30, 31), event(40, 41)]
    score = score_events(proposed, true, "stuck")
    assert score == EventScore(proposed=3, right=2, true=4, found=2)
    assert score.precision == pytest.approx(2 / 3)
    assert score.recall == pytest.approx(1 / 2)


def test_a_long_event_may_be_found_in_parts() -> None:
    parts = [event(1, 2), event(3, 4), event(5, 6)]
    assert score_events(parts, [event(0, 7)], "stuck") == EventScore(3, 3, 1, 1)


@pytest.mark.parametrize(("gap_s", "matched"), [(0.29, 1), (0.31, 0)])
def test_events_may_miss_one_another_by_the_tolerance(gap_s: float, matched: int) -> None:
    score = score_events([event(1, 2)], [event(2 + gap_s, 3 + gap_s)], "stuck")
    assert (score.right, score.found) == (matched, matched)


def test_only_events_of_the_kind_count() -> None:
    score = score_events([event(1, 2, "collision")], [event(1, 2)], "stuck")
    assert score == EventScore(0, 0, 1, 0)
    assert score.precision is None
    assert score.recall == 0.0


def test_steps_are_compared_where_they_are_judged() -> None:
    success = np.array([[1, 1, 0, 0], [1, 0, 0, 0], [1, 1, 1, 1]], np.uint8)
    mask = np.array([[1, 1, 1, 1], [1, 1, 0, 0], [1, 1, 1, 1]], np.bool_)
    truth = np.array([[1, 1, 0, 0], [1, 1, 1, 1], [1, 1, 1, 0]], np.bool_)
    score = score_steps(RowLabels(success, mask, np.ones_like(success)), truth)
    assert score == StepScore(
        steps=12, judged=10, agreeing=8, labelled_failing=3, truly_failing=3, both_failing=2
    )
    assert score.agreement == pytest.approx(8 / 10)
    assert score.precision == score.recall == pytest.approx(2 / 3)
