"""Curves to draw: ROC and calibration."""

from __future__ import annotations

import numpy as np
from sklearn.metrics import roc_curve

from graspe_data.arrays import Floats, Mask
from model_zoo.evaluation.cell import ROC_POINTS, CalibrationCurve, RocCurve
from model_zoo.metrics import CALIBRATION_BINS, calibration_bin

_GRID = np.linspace(0, 1, ROC_POINTS)
_DIGITS = 5


def roc(log_odds: Floats, success: Mask) -> RocCurve | None:
    """The ROC curve at 201 even shares of accepted failures; None for one class alone.

    Args:
        log_odds: (judged,).
        success: (judged,).
    """
    if not success.any() or success.all():
        return None
    false_positive, true_positive, _ = roc_curve(success, log_odds)
    heights = np.interp(_GRID, false_positive, true_positive)
    heights[0] = 0
    return RocCurve(false_positive=_rounded(_GRID), true_positive=_rounded(heights))


def calibration_curve(probability: Floats, success: Mask) -> CalibrationCurve:
    """Mean probability and share of successes in each of the 15 bins that is not empty.

    Args:
        probability: (judged,).
        success: (judged,).
    """
    bins = calibration_bin(probability)
    judged = np.bincount(bins, minlength=CALIBRATION_BINS)
    filled = judged > 0
    total = np.bincount(bins, probability, CALIBRATION_BINS)[filled]
    successes = np.bincount(bins, success.astype(np.float64), CALIBRATION_BINS)[filled]
    return CalibrationCurve(
        probability=_rounded(total / judged[filled]),
        success=_rounded(successes / judged[filled]),
        judged=tuple(judged[filled].tolist()),
    )


def _rounded(values: Floats) -> tuple[float, ...]:
    return tuple(np.round(values, _DIGITS).tolist())
