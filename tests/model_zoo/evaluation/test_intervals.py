"""Intervals over trainings and recordings together, and differences on the same resamples."""

from __future__ import annotations

import numpy as np
import pytest

from model_zoo.evaluation.bootstrap import draw_weights, joint_resamples
from model_zoo.evaluation.cell import Part, ReferenceCell, StoredScore
from model_zoo.evaluation.entrants import Entrant


def entrant(scores: np.ndarray, seed: int = 1) -> Entrant:
    """One whose trainings have these AU-ROC, (R, S), on every resample of recordings."""

    class Training:
        def __init__(self, drawn: np.ndarray) -> None:
            value = StoredScore(value=float(drawn.mean()), low=None, high=None)
            part = Part(rows=9, judged=9, au_roc=value, resamples=tuple(drawn.tolist()))
            self.only = ReferenceCell(
                scenario="all", condition="clean", parts={"not_failing": part}
            )

        def cell(self, scenario: str = "all", condition: str = "clean") -> ReferenceCell:
            assert (scenario, condition) == ("all", "clean")
            return self.only

    return Entrant("model", [Training(drawn) for drawn in scores], seed)


def test_one_training_varies_by_recordings_alone() -> None:
    drawn = np.linspace(0.5, 0.9, 200)[None]
    assert np.array_equal(joint_resamples(drawn, 0), drawn[0])


def test_trainings_that_differ_widen_the_interval() -> None:
    same = np.full((5, 1), 0.7) + np.random.default_rng(0).normal(0, 0.01, (1, 1000))
    apart = same + np.array([-0.1, -0.05, 0, 0.05, 0.1])[:, None]
    narrow, wide = (entrant(scores).au_roc("all", "clean") for scores in (same, apart))
    assert narrow.value == pytest.approx(wide.value)
    widths = [score.high - score.low for score in (narrow, wide)]  # type: ignore[operator]
    assert widths[1] > 2 * widths[0]


def test_the_spread_is_that_of_means_of_new_trainings() -> None:
    trainings = np.random.default_rng(0).normal(0.7, 0.02, 4)
    found = joint_resamples(np.repeat(trainings[:, None], 20_000, axis=1), 3)
    assert found.std() == pytest.approx(trainings.std(ddof=1) / 2, rel=0.03)
    assert found.mean() == pytest.approx(trainings.mean(), abs=1e-3)


def test_what_recordings_share_cancels_in_a_difference() -> None:
    recordings = np.random.default_rng(0).normal(0.7, 0.05, 1000)
    one, other = entrant(recordings[None]), entrant(recordings[None] - 0.02)
    found = one.advantage(other, "all", "clean")
    assert found.value == pytest.approx(0.02)
    assert one.au_roc("all", "clean").low is None
    noisy = entrant(recordings[None] - 0.02 + np.linspace(-1e-3, 1e-3, 1000))
    found = one.advantage(noisy, "all", "clean")
    assert found.low == pytest.approx(0.019, abs=1e-3)
    assert found.high == pytest.approx(0.021, abs=1e-3)


def test_scenarios_are_drawn_apart_and_a_scenario_always_alike() -> None:
    one, again, other = (draw_weights(6, 500, 0, place) for place in ("hill", "hill", "lake"))
    assert np.array_equal(one, again)
    assert (one.sum(axis=1) == 6).all()
    apart = np.corrcoef(one.T, other.T)[:6, 6:]
    assert np.abs(apart).max() < 0.2


def test_trainings_of_two_models_are_drawn_apart_and_of_one_alike() -> None:
    apart = np.array([[0.6], [0.8]]) + np.zeros((2, 400))
    first, second = entrant(apart, seed=1), entrant(apart, seed=2)
    assert first.advantage(first, "all", "clean").low is None
    found = first.advantage(second, "all", "clean")
    assert found.low is not None
    assert found.low < -0.1
