"""Scores of predictions against judged labels; 1 = success.

Every function takes log-odds of success, labels and the mask of judged steps, all (N, T), and gives
None where the score is not defined: nothing judged, or judgements of one class only. Log-odds,
since probabilities that are rounded to 0 or 1 no longer tell what is more likely than what.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike, NDArray
from sklearn.metrics import average_precision_score, brier_score_loss, roc_auc_score

from graspe_data.arrays import Floats, Mask
from graspe_data.errors import ZooError

CALIBRATION_BINS = 15
"""Of equal width over 0 .. 1, as in Guo et al., ICML 2017."""


def au_roc(log_odds: ArrayLike, success: ArrayLike, mask: ArrayLike) -> float | None:
    """Area under the ROC curve over all judged steps of all rows, pooled."""
    z, y = judged_steps(log_odds, success, mask)
    return float(roc_auc_score(y, z)) if _has_both(y) else None


def minimum_au_roc(log_odds: ArrayLike, success: ArrayLike, mask: ArrayLike) -> float | None:
    """Area under the ROC curve of whole trajectories, by the minimum of their judged steps."""
    z, y, _ = judged_rows(log_odds, success, mask)
    return float(roc_auc_score(y, z)) if _has_both(y) else None


def average_precision(log_odds: ArrayLike, success: ArrayLike, mask: ArrayLike) -> float | None:
    """Average precision of success over the judged steps, pooled."""
    z, y = judged_steps(log_odds, success, mask)
    return float(average_precision_score(y, z)) if _has_both(y) else None


def failure_average_precision(
    log_odds: ArrayLike, success: ArrayLike, mask: ArrayLike
) -> float | None:
    """Average precision of failure, the rarer class, over the judged steps, pooled."""
    z, y = judged_steps(log_odds, success, mask)
    return float(average_precision_score(~y, -z)) if _has_both(y) else None


def brier(log_odds: ArrayLike, success: ArrayLike, mask: ArrayLike) -> float | None:
    """Mean squared difference between probability and label over the judged steps."""
    z, y = judged_steps(log_odds, success, mask)
    return float(brier_score_loss(y, probability(z), pos_label=1)) if y.size else None


def expected_calibration_error(
    log_odds: ArrayLike, success: ArrayLike, mask: ArrayLike
) -> float | None:
    """Mean distance of probability and share of successes in 15 bins of probability.

    Equation (3) of Guo et al., ICML 2017, with the probability of success for the confidence.
    """
    z, y = judged_steps(log_odds, success, mask)
    if not y.size:
        return None
    p = probability(z)
    gap = np.bincount(calibration_bin(p), weights=p - y, minlength=CALIBRATION_BINS)
    return float(np.abs(gap).sum() / y.size)


def judged_steps(log_odds: ArrayLike, success: ArrayLike, mask: ArrayLike) -> tuple[Floats, Mask]:
    """Log-odds and labels of the judged steps, (judged,) each.

    Raises:
        ZooError: The shapes differ, or what is predicted of a judged step is not finite.
    """
    z, y, judged = _arrays(log_odds, success, mask)
    return z[judged], y[judged]


def judged_rows(
    log_odds: ArrayLike, success: ArrayLike, mask: ArrayLike
) -> tuple[Floats, Mask, Mask]:
    """Least log-odds of the judged steps, and whether all succeed, of rows that have any.

    Returns:
        Log-odds and labels (rows,), and which of the N rows they are, bool (N,).

    Raises:
        ZooError: As :func:`judged_steps`.
    """
    z, y, judged = _arrays(log_odds, success, mask)
    rows = np.asarray(judged.any(axis=1))
    least = np.where(judged, z, np.inf).min(axis=1, initial=np.inf)
    whole = np.asarray(np.where(judged, y, True).all(axis=1))
    return least[rows], whole[rows], rows


def probability(log_odds: Floats) -> Floats:
    """Of success, from its log-odds."""
    found: Floats = np.exp(-np.logaddexp(0, -log_odds))
    return found


def calibration_bin(p: Floats) -> NDArray[np.int64]:
    """The bin of each probability, 0 .. 14."""
    return np.clip(p * CALIBRATION_BINS, 0, CALIBRATION_BINS - 1).astype(np.int64)


def _arrays(log_odds: ArrayLike, success: ArrayLike, mask: ArrayLike) -> tuple[Floats, Mask, Mask]:
    z = np.asarray(log_odds, dtype=np.float64)
    y, judged = np.asarray(success, dtype=bool), np.asarray(mask, dtype=bool)
    if z.ndim != 2 or z.shape != y.shape or z.shape != judged.shape:  # noqa: PLR2004
        raise ZooError(
            f"scores: expected log-odds, success and mask of one shape (N, T), found "
            f"{z.shape}, {y.shape} and {judged.shape}."
        )
    if not np.isfinite(z[judged]).all():
        raise ZooError("scores: what is predicted is not finite: the model has diverged.")
    return z, y, judged


def _has_both(labels: Mask) -> bool:
    return bool(labels.any() and not labels.all())


METRICS: dict[str, Callable[[ArrayLike, ArrayLike, ArrayLike], float | None]] = {
    "au_roc": au_roc,
    "minimum_au_roc": minimum_au_roc,
    "average_precision": average_precision,
    "failure_average_precision": failure_average_precision,
    "brier": brier,
    "expected_calibration_error": expected_calibration_error,
}
"""What is scored, in the order of tables."""
