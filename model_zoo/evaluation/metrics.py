"""Scores of predicted probabilities against judged labels; 1 = success.

Every function takes probabilities, labels and the mask of judged steps, all (N, T), and gives None
where the score is not defined: nothing judged, or judgements of one class only.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray
from sklearn.metrics import average_precision_score, brier_score_loss, roc_auc_score

from graspe_data.errors import ZooError

CALIBRATION_BINS = 15
"""Of equal width over 0 .. 1, as in Guo et al., ICML 2017."""

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]


def au_roc(probability: ArrayLike, success: ArrayLike, mask: ArrayLike) -> float | None:
    """Area under the ROC curve over all judged steps of all rows, pooled."""
    p, y = judged_steps(probability, success, mask)
    return float(roc_auc_score(y, p)) if _has_both(y) else None


def minimum_au_roc(probability: ArrayLike, success: ArrayLike, mask: ArrayLike) -> float | None:
    """Area under the ROC curve of whole trajectories, by the minimum of their judged steps."""
    p, y, _ = judged_rows(probability, success, mask)
    return float(roc_auc_score(y, p)) if _has_both(y) else None


def average_precision(probability: ArrayLike, success: ArrayLike, mask: ArrayLike) -> float | None:
    """Average precision of success over the judged steps, pooled."""
    p, y = judged_steps(probability, success, mask)
    return float(average_precision_score(y, p)) if _has_both(y) else None


def failure_average_precision(
    probability: ArrayLike, success: ArrayLike, mask: ArrayLike
) -> float | None:
    """Average precision of failure, the rarer class, over the judged steps, pooled."""
    p, y = judged_steps(probability, success, mask)
    return float(average_precision_score(~y, -p)) if _has_both(y) else None


def brier(probability: ArrayLike, success: ArrayLike, mask: ArrayLike) -> float | None:
    """Mean squared difference between probability and label over the judged steps."""
    p, y = judged_steps(probability, success, mask)
    return float(brier_score_loss(y, p, pos_label=1)) if y.size else None


def expected_calibration_error(
    probability: ArrayLike, success: ArrayLike, mask: ArrayLike
) -> float | None:
    """Mean distance of probability and share of successes in 15 bins of probability.

    Equation (3) of Guo et al., ICML 2017, with the probability of success for the confidence.
    """
    p, y = judged_steps(probability, success, mask)
    if not y.size:
        return None
    gap = np.bincount(calibration_bin(p), weights=p - y, minlength=CALIBRATION_BINS)
    return float(np.abs(gap).sum() / y.size)


def judged_steps(
    probability: ArrayLike, success: ArrayLike, mask: ArrayLike
) -> tuple[Floats, Bools]:
    """Probabilities and labels of the judged steps, (judged,) each.

    Raises:
        ZooError: The shapes differ, or a probability of a judged step is not finite.
    """
    p, y, judged = _arrays(probability, success, mask)
    return p[judged], y[judged]


def judged_rows(
    probability: ArrayLike, success: ArrayLike, mask: ArrayLike
) -> tuple[Floats, Bools, Bools]:
    """Least probability of the judged steps, and whether all succeed, of rows that have any.

    Returns:
        Probabilities and labels (rows,), and which of the N rows they are, bool (N,).

    Raises:
        ZooError: As :func:`judged_steps`.
    """
    p, y, judged = _arrays(probability, success, mask)
    rows = np.asarray(judged.any(axis=1))
    least = np.where(judged, p, np.inf).min(axis=1, initial=np.inf)
    whole = np.asarray(np.where(judged, y, True).all(axis=1))
    return least[rows], whole[rows], rows


def calibration_bin(probability: Floats) -> NDArray[np.int64]:
    """The bin of each probability, 0 .. 14."""
    return np.clip(probability * CALIBRATION_BINS, 0, CALIBRATION_BINS - 1).astype(np.int64)


def _arrays(
    probability: ArrayLike, success: ArrayLike, mask: ArrayLike
) -> tuple[Floats, Bools, Bools]:
    p = np.asarray(probability, dtype=np.float64)
    y, judged = np.asarray(success, dtype=bool), np.asarray(mask, dtype=bool)
    if p.ndim != 2 or p.shape != y.shape or p.shape != judged.shape:  # noqa: PLR2004
        raise ZooError(
            f"scores: expected probability, success and mask of one shape (N, T), found "
            f"{p.shape}, {y.shape} and {judged.shape}."
        )
    if not np.isfinite(p[judged]).all():
        raise ZooError("scores: a predicted probability is not finite: the model has diverged.")
    return p, y, judged


def _has_both(labels: Bools) -> bool:
    return bool(labels.any() and not labels.all())
