from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

from graspe_data.errors import ZooError
from model_zoo.checkpoints import fit_temperature


def drawn(
    seed: int, temperature: float, count: int = 300
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Logits that are too large by a factor, and labels."""
    random = np.random.default_rng(seed)
    z = random.normal(0.5, 1.5, (count, 4))
    return z * temperature, random.random(z.shape) < 1 / (1 + np.exp(-z))


@settings(deadline=None, max_examples=25)
@given(st.integers(0, 10**6), st.floats(0.3, 5))
def test_no_other_temperature_has_less_loss(seed: int, temperature: float) -> None:
    logits, success = drawn(seed, temperature, 60)

    def loss(log_temperature: float) -> float:
        scaled = logits / np.exp(log_temperature)
        return float(np.mean(np.logaddexp(0, scaled) - success * scaled))

    fitted = fit_temperature(logits, success, np.ones_like(success))
    best = minimize_scalar(loss, bounds=(np.log(0.05), np.log(20)), method="bounded").fun
    assert fitted.loss_after <= best + 1e-9
    assert fitted.loss_after <= fitted.loss_before


def test_the_factor_that_was_put_in_is_found() -> None:
    logits, success = drawn(0, 3.0, 5000)
    assert fit_temperature(logits, success, success >= 0).temperature == pytest.approx(3, rel=0.05)


def test_steps_that_are_not_judged_do_not_count() -> None:
    logits, success = drawn(0, 3.0)
    mask = np.random.default_rng(1).random(success.shape) < 0.5
    spoiled = np.where(mask, logits, np.nan)
    assert fit_temperature(spoiled, success, mask) == fit_temperature(logits, success, mask)
    assert fit_temperature(logits, success, mask).judged == mask.sum()


def test_labels_that_follow_from_the_signs_give_the_bound() -> None:
    logits = np.array([[-2.0, 1.0, 3.0]])
    mask = np.ones((1, 3), bool)
    assert fit_temperature(logits, logits > 0, mask).temperature == pytest.approx(0.05)
    assert fit_temperature(logits, logits < 0, mask).temperature == pytest.approx(20)


def test_what_cannot_be_fitted_is_refused() -> None:
    with pytest.raises(ZooError, match="no step of the validation rows is judged"):
        fit_temperature([[1.0]], [[1]], [[False]])
    with pytest.raises(ZooError, match="not finite"):
        fit_temperature([[np.inf]], [[1]], [[True]])
