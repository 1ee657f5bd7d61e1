"""Scores of several recordings: the sums of their counts."""

from __future__ import annotations

from pipelines.label_scores import LabelScore, sum_scores
from pipelines.score_counts import EventScore, StepScore


def test_scores_of_recordings_add_up() -> None:
    one = LabelScore(1, {"stuck": EventScore(1, 1, 2, 1)}, StepScore(10, 8, 6, 2, 2, 1))
    both = sum_scores(
        LabelScore(
            one.recordings,
            one.events | {"collision": EventScore(), "stumble": EventScore()},
            one.steps,
        )
        for _ in range(2)
    )
    assert both.recordings == 2
    assert both.events["stuck"] == EventScore(2, 2, 4, 2)
    assert both.steps == StepScore(20, 16, 12, 4, 4, 2)


def test_no_recordings_have_no_scores() -> None:
    nothing = sum_scores([])
    assert nothing.recordings == 0
    assert nothing.steps.agreement is nothing.events["stumble"].precision is None
