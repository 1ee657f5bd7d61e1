"""Predictions to scores and curves: each scenario, and all together, with intervals."""

from __future__ import annotations

import numpy as np
from sklearn.metrics import roc_curve

from graspe_data.arrays import Floats, Indices, Mask
from model_zoo import metrics
from model_zoo.evaluation.bootstrap import draw_weights, resampled_scores
from model_zoo.evaluation.cell import (
    ALL_SCENARIOS,
    ROC_POINTS,
    CalibrationCurve,
    Cell,
    RocCurve,
    StoredScore,
)
from model_zoo.evaluation.judged_split import JudgedSplit
from model_zoo.metrics import CALIBRATION_BINS, METRICS, calibration_bin

_Labelled = tuple[Floats, Mask, Mask]

_DEFINED_SHARE = 0.5
"""An interval needs the score defined in at least so many of the resamples."""

FEWEST_RECORDINGS = 3
"""Fewer give no interval: their resamples hardly differ."""


def score_cells(
    split: JudgedSplit, log_odds: Floats, condition: str, resamples: int, seed: int
) -> list[Cell]:
    """Score all rows together and each scenario.

    Args:
        split: The rows and their labels.
        log_odds: (N, T), of success.
        condition: For the cells' name.
        resamples: Of recordings.
        seed: Of the resamples: the same for every model, so that they can be compared.
    """
    scenario = np.asarray(split.scenarios)[split.recording]
    chosen = {ALL_SCENARIOS: np.ones(scenario.size, bool)}
    chosen |= {name: scenario == name for name in sorted(set(scenario.tolist()))}
    cells = []
    for name, rows in chosen.items():
        labelled = (log_odds[rows], split.success[rows], split.mask[rows])
        recordings, recording = np.unique(split.recording[rows], return_inverse=True)
        weights = draw_weights(recordings.size, resamples, seed)
        cells.append(_cell(name, condition, labelled, recording, weights))
    return cells


def _cell(
    scenario: str, condition: str, labelled: _Labelled, recording: Indices, weights: Floats
) -> Cell:
    drawn = resampled_scores(*labelled, recording, weights)
    enough = weights.shape[1] >= FEWEST_RECORDINGS
    z, y = metrics.judged_steps(*labelled)
    return Cell(
        scenario=scenario,
        condition=condition,
        recordings=weights.shape[1],
        rows=recording.size,
        judged=z.size,
        success_share=float(y.mean()) if y.size else None,
        scores={
            name: _score(score(*labelled), drawn[name] if enough else drawn[name][:0])
            for name, score in METRICS.items()
        },
        au_roc_resamples=_listed(drawn["au_roc"]) if enough else (),
        roc=roc(z, y),
        calibration=calibration_curve(metrics.probability(z), y),
    )


def _score(value: float | None, drawn: Floats) -> StoredScore:
    low, high = interval(drawn)
    return StoredScore(value=value, low=low, high=high)


def interval(drawn: Floats) -> tuple[float, float] | tuple[None, None]:
    """The middle 95 % of resampled scores.

    None where they say nothing: there are none, most are NaN, or all are the same.
    """
    defined = drawn[np.isfinite(drawn)]
    if defined.size < max(1, _DEFINED_SHARE * drawn.size) or np.ptp(defined) == 0:
        return None, None
    low, high = np.quantile(defined, [0.025, 0.975])
    return float(low), float(high)


def _listed(drawn: Floats) -> tuple[float | None, ...]:
    rounded = np.round(drawn, 5).tolist()
    return tuple(value if np.isfinite(value) else None for value in rounded)


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
    # The curve has a point for each threshold; on an even grid curves can be averaged.
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
    # Sums over what lies in each bin; bins without a judged step are left out.
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
