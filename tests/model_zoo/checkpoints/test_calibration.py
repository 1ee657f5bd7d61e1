from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import minimize_scalar

from graspe_data.errors import ZooError
from model_zoo.checkpoints import TemperatureScaling, Uncalibrated, fit_temperature
from model_zoo.checkpoints.calibration import COLDEST, FEWEST_ROWS, HOTTEST


def drawn(
    seed: int, temperature: float, count: int = 300
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Logits that are too large by a factor, and labels."""
    random = np.random.default_rng(seed)
    z = random.normal(0.5, 1.5, (count, 4))
    return z * temperature, random.random(z.shape) < 1 / (1 + np.exp(-z))


def fit(logits: ArrayLike, success: ArrayLike, mask: ArrayLike) -> TemperatureScaling:
    found = fit_temperature(logits, success, mask)
    assert isinstance(found, TemperatureScaling)
    return found


@settings(deadline=None, max_examples=25)
@given(st.integers(0, 10**6), st.floats(0.3, 5))
def test_no_other_temperature_has_less_loss(seed: int, temperature: float) -> None:
    logits, success = drawn(seed, temperature, 60)

    def loss(log_temperature: float) -> float:
        scaled = logits / np.exp(log_temperature)
        return float(np.mean(np.logaddexp(0, scaled) - success * scaled))

    fitted = fit(logits, success, np.ones_like(success))
    best = minimize_scalar(loss, bounds=(np.log(COLDEST), np.log(HOTTEST)), method="bounded").fun
    assert fitted.loss_after <= best + 1e-9
    assert fitted.loss_after <= fitted.loss_before


def test_the_factor_that_was_put_in_is_found() -> None:
    logits, success = drawn(0, 3.0, 5000)
    assert fit(logits, success, success >= 0).temperature == pytest.approx(3, rel=0.05)


def test_steps_that_are_not_judged_do_not_count() -> None:
    logits, success = drawn(0, 3.0)
    mask = np.random.default_rng(1).random(success.shape) < 0.5
    spoiled = np.where(mask, logits, np.nan)
    assert fit_temperature(spoiled, success, mask) == fit_temperature(logits, success, mask)
    assert fit(logits, success, mask).judged == mask.sum()


def test_labels_that_follow_from_the_signs_give_the_bound_and_say_so() -> None:
    logits = np.tile([[-2.0, 1.0, 3.0]], (10, 1))
    mask = np.ones_like(logits, bool)
    coldest, hottest = (fit(logits, wins, mask) for wins in (logits > 0, logits < 0))
    assert (coldest.temperature, coldest.at_bound) == (COLDEST, True)
    assert (hottest.temperature, hottest.at_bound) == (HOTTEST, True)
    assert str(coldest) == "temperature 0.250, the bound"
    assert not fit(*drawn(0, 1.0), np.ones((300, 4), bool)).at_bound


@given(failing=st.integers(0, 15), succeeding=st.integers(0, 15))
def test_too_few_rows_of_either_kind_give_no_temperature(failing: int, succeeding: int) -> None:
    success = np.repeat([[False], [True]], [failing, succeeding], axis=0)
    logits = np.linspace(-1, 1, len(success))[:, None]
    if not len(success):
        return
    found = fit_temperature(logits, success, np.ones_like(success))
    if min(failing, succeeding) >= FEWEST_ROWS:
        assert isinstance(found, TemperatureScaling)
        assert found.failing_rows == failing
    else:
        assert isinstance(found, Uncalibrated)
        assert found.reason.startswith(
            f"{failing} validation rows have a failing step and {succeeding} a succeeding one"
        )


def test_many_failing_steps_of_one_row_are_one_row() -> None:
    success = np.ones((50, 10), bool)
    success[0] = False
    found = fit_temperature(np.ones((50, 10)), success, np.ones_like(success))
    assert isinstance(found, Uncalibrated)
    judged = np.ones_like(success)
    judged[0] = False
    assert "0 validation rows have a failing step" in str(
        fit_temperature(np.ones((50, 10)), success, judged)
    )


def test_what_cannot_be_fitted_is_refused() -> None:
    with pytest.raises(ZooError, match="no step of the validation rows is judged"):
        fit_temperature([[1.0]], [[1]], [[False]])
    with pytest.raises(ZooError, match="not finite"):
        fit_temperature([[np.inf]], [[1]], [[True]])
