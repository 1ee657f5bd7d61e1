from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from sklearn.calibration import calibration_curve as sklearn_curve
from sklearn.metrics import average_precision_score, roc_auc_score

from graspe_data.arrays import Floats, Mask
from graspe_data.errors import ZooError
from model_zoo import metrics
from model_zoo.evaluation.bootstrap import draw_weights, resampled_scores
from model_zoo.evaluation.score_cells import calibration_curve, interval, roc
from model_zoo.metrics import METRICS

ALL = tuple(METRICS.values())


def logit(p: Floats) -> Floats:
    return np.asarray(np.log(p) - np.log1p(-p))


def drawn(seed: int, rows: int = 40, ties: bool = True) -> tuple[Floats, Mask, Mask]:
    random = np.random.default_rng(seed)
    p = random.uniform(0.05, 0.95, (rows, 5))
    if ties:
        p = np.round(p, 1).clip(0.05, 0.95)
    success = random.random((rows, 5)) < p
    return logit(p), success, random.random((rows, 5)) < 0.8


def test_small_cases_by_hand() -> None:
    p = logit(np.array([[0.9, 0.8], [0.7, 0.3]]))
    success = np.array([[1, 1], [0, 1]])
    mask = np.array([[True, True], [True, False]])
    assert metrics.au_roc(p, success, mask) == 1
    assert metrics.minimum_au_roc(p, success, mask) == 1
    assert metrics.average_precision(p, success, mask) == 1
    assert metrics.brier(p, success, mask) == pytest.approx((0.01 + 0.04 + 0.49) / 3)
    assert metrics.expected_calibration_error(p, success, mask) == pytest.approx(
        (0.1 + 0.2 + 0.7) / 3
    )
    everything = np.ones((2, 2), bool)
    assert metrics.au_roc(p, success, everything) == pytest.approx(2 / 3)


def test_what_float32_rounds_to_one_is_still_ranked() -> None:
    z = np.random.default_rng(0).normal(0, 2, (400, 5))
    success = np.random.default_rng(1).random((400, 5)) < metrics.probability(z)
    mask = np.ones_like(success)
    area = metrics.au_roc(z, success, mask)
    assert area is not None
    for temperature in (1.0, 0.05, 0.001):
        assert metrics.au_roc(z / temperature, success, mask) == area
        rounded = metrics.probability(z / temperature).astype(np.float32)
        if temperature < 1:
            tied = metrics.au_roc(rounded, success, mask)
            assert tied is not None
            assert tied < area - 0.003
    assert metrics.brier(z / 0.001, success, mask) == pytest.approx(
        ((z > 0) != success).mean(), 1e-2
    )


def test_a_trajectory_is_as_good_as_its_worst_judged_step() -> None:
    p = np.array([[0.9, 0.1, 0.8], [0.6, 0.5, 0.9], [0.0, 0.0, 0.0]])
    success = np.array([[1, 0, 1], [1, 1, 0], [0, 0, 0]])
    mask = np.array([[1, 0, 1], [1, 1, 1], [0, 0, 0]], dtype=bool)
    least, whole, rows = metrics.judged_rows(p, success, mask)
    assert least.tolist() == [0.8, 0.5]
    assert whole.tolist() == [True, False]
    assert rows.tolist() == [True, True, False]


@settings(deadline=None, max_examples=20)
@given(st.integers(0, 10**6))
def test_what_is_not_judged_changes_nothing(seed: int) -> None:
    p, success, mask = drawn(seed)
    random = np.random.default_rng(seed + 1)
    other = np.where(mask, p, random.choice([0.5, np.nan]))
    flipped = np.where(mask, success, ~success)
    for score in ALL:
        assert score(other, flipped, mask) == score(p, success, mask)


def test_where_a_score_is_not_defined_there_is_none() -> None:
    p, success, mask = drawn(0)
    nothing = np.zeros_like(mask)
    assert [score(p, success, nothing) for score in ALL] == [None] * len(ALL)
    one_class = [score(p, np.ones_like(success), mask) for score in ALL]
    assert one_class[:4] == [None] * 4
    assert None not in one_class[4:]


def test_what_cannot_be_scored_is_refused() -> None:
    p, success, mask = drawn(0)
    with pytest.raises(ZooError, match=r"found \(40, 5\), \(40, 4\) and \(40, 5\)"):
        metrics.au_roc(p, success[:, :4], mask)
    with pytest.raises(ZooError, match="not finite"):
        metrics.brier(np.where(mask, np.nan, p), success, mask)


def test_calibration_bins_are_those_of_scikit_learn() -> None:
    p, success, mask = drawn(1, rows=300, ties=False)
    judged, labels = metrics.judged_steps(p, success, mask)
    judged = metrics.probability(judged)
    curve = calibration_curve(judged, labels)
    share, probability = sklearn_curve(labels, judged, n_bins=metrics.CALIBRATION_BINS)
    assert np.allclose(curve.success, share, atol=1e-5)
    assert np.allclose(curve.probability, probability, atol=1e-5)
    gaps = np.abs(np.subtract(curve.success, curve.probability)) @ curve.judged
    error = metrics.expected_calibration_error(p, success, mask)
    assert error == pytest.approx(gaps / judged.size, abs=1e-5)


def test_the_roc_curve_has_the_area() -> None:
    p, success, mask = drawn(2, rows=400, ties=False)
    curve = roc(*metrics.judged_steps(p, success, mask))
    assert curve is not None
    area = np.trapezoid(curve.true_positive, curve.false_positive)
    assert area == pytest.approx(metrics.au_roc(p, success, mask), abs=3e-3)
    assert (curve.true_positive[0], curve.true_positive[-1]) == (0, 1)
    assert roc(p[mask], np.ones(mask.sum(), bool)) is None


@settings(deadline=None, max_examples=20)
@given(st.integers(0, 10**6), st.booleans())
def test_resampled_scores_are_those_of_rows_repeated(seed: int, ties: bool) -> None:
    p, success, mask = drawn(seed, ties=ties)
    recording = np.random.default_rng(seed).integers(0, 5, len(p))
    weights = draw_weights(5, 6, seed)
    found = resampled_scores(p, success, mask, recording, weights)
    for sample, weight in enumerate(weights):
        rows = np.repeat(np.arange(len(p)), weight[recording].astype(int))
        for name, score in METRICS.items():
            expected = score(p[rows], success[rows], mask[rows])
            if expected is None:
                assert np.isnan(found[name][sample])
            else:
                assert found[name][sample] == pytest.approx(expected, abs=1e-9)


def test_resampled_scores_are_those_of_scikit_learn_with_weights() -> None:
    p, success, mask = drawn(7)
    recording = np.arange(len(p)) % 4
    weights = np.array([[0.0, 1.0, 2.0, 5.0]])
    found = resampled_scores(p, success, mask, recording, weights)
    each = np.broadcast_to(weights[0][recording][:, None], p.shape)[mask]
    labels, judged = success[mask], p[mask]
    area = roc_auc_score(labels, judged, sample_weight=each)
    precision = average_precision_score(labels, judged, sample_weight=each)
    assert found["au_roc"][0] == pytest.approx(area)
    assert found["average_precision"][0] == pytest.approx(precision)


def test_recordings_are_drawn_as_often_as_there_are_and_by_the_seed() -> None:
    weights = draw_weights(7, 200, 3)
    assert (weights.sum(axis=1) == 7).all()
    assert np.array_equal(weights, draw_weights(7, 200, 3))
    assert not np.array_equal(weights, draw_weights(7, 200, 4))
    assert weights.mean(axis=0) == pytest.approx(np.ones(7), abs=0.3)


def test_an_interval_holds_the_middle_or_says_nothing() -> None:
    assert interval(np.linspace(0, 1, 1001)) == pytest.approx((0.025, 0.975))
    assert interval(np.full(10, 0.5)) == (None, None)
    assert interval(np.array([0.1, np.nan, np.nan])) == (None, None)
