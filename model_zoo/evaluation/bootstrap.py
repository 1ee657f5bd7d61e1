"""Scores of resampled recordings and trainings, without computing each score anew.

Rows of one recording resemble each other, so recordings are what is drawn with replacement, not
rows. A resample is a weight for each recording; every score here is exact for whole weights.
"""

from __future__ import annotations

import zlib

import numpy as np
from numpy.typing import NDArray

from graspe_data.arrays import Floats, Indices, Mask
from model_zoo.metrics import (
    CALIBRATION_BINS,
    calibration_bin,
    judged_rows,
    judged_steps,
    probability,
)


def draw_weights(recordings: int, resamples: int, seed: int, place: str = "") -> Floats:
    """How often each recording is drawn in each resample, (resamples, recordings).

    Scenarios are drawn apart by the names of their places: their recordings have nothing to do with
    each other, and the mean over scenarios varies as little as that.
    """
    generator = np.random.default_rng([seed, recordings, zlib.crc32(place.encode())])
    share = np.full(recordings, 1 / recordings)
    return generator.multinomial(recordings, share, size=resamples).astype(np.float64)


def joint_resamples(scores: Floats, seed: int) -> Floats:
    """Means over resampled trainings, each on its own resample of recordings, (S,).

    In every resample as many trainings are drawn, with replacement, as there are. Of R trainings
    the mean of R draws varies by (R - 1) / R of what the mean of R new ones would, so what it lies
    off the mean of all is stretched by the root of R / (R - 1).

    Args:
        scores: (R, S), of each training on every resample of recordings.
        seed: Of the draws.
    """
    count, resamples = scores.shape
    whole: Floats = scores.mean(axis=0)
    if count == 1:
        return whole
    draws = np.random.default_rng([seed, count]).integers(count, size=(count, resamples))
    drawn = np.take_along_axis(scores, draws, axis=0).mean(axis=0)
    stretched: Floats = whole + np.sqrt(count / (count - 1)) * (drawn - whole)
    return stretched


def resampled_au_roc(
    log_odds: Floats, success: Mask, mask: Mask, recording: Indices, weights: Floats
) -> Floats:
    """AU-ROC of every resample, (S,); see :func:`resampled_scores`."""
    z, y = judged_steps(log_odds, success, mask)
    owner = np.broadcast_to(recording[:, None], mask.shape)[mask]
    with np.errstate(invalid="ignore", divide="ignore"):
        return _au_roc(z, y, owner, weights)


def resampled_scores(
    log_odds: Floats, success: Mask, mask: Mask, recording: Indices, weights: Floats
) -> dict[str, Floats]:
    """Every score of every resample.

    Args:
        log_odds: Of success, (N, T).
        success: (N, T).
        mask: (N, T), true where judged.
        recording: (N,), each in 0 .. R - 1.
        weights: (S, R), of :func:`draw_weights`.

    Returns:
        By the name of the function in :mod:`model_zoo.metrics`, (S,); NaN where a
        resample has one class only.
    """
    z, y = judged_steps(log_odds, success, mask)
    owner = np.broadcast_to(recording[:, None], mask.shape)[mask]
    least, whole, rows = judged_rows(log_odds, success, mask)
    steps, sure = (z, y, owner, weights), (probability(z), y, owner, weights)
    with np.errstate(invalid="ignore", divide="ignore"):
        return {
            "au_roc": _au_roc(*steps),
            "minimum_au_roc": _au_roc(least, whole, recording[rows], weights),
            "average_precision": _average_precision(*steps),
            "failure_average_precision": _average_precision(-z, ~y, owner, weights),
            "brier": _brier(*sure),
            "expected_calibration_error": _calibration_error(*sure),
        }


def _au_roc(p: Floats, y: Mask, owner: Indices, weights: Floats) -> Floats:
    """From the pairs of a success and a failure in order, counted by their recordings.

    The area is the share of such pairs (Mann and Whitney), ties half: a quadratic form in the
    recordings' weights.
    """
    # Successes from the least likely up, and the recording of each.
    order = np.argsort(p[y], kind="stable")
    successes, of = p[y][order], owner[y][order]
    count = weights.shape[1]
    # pairs[r, q]: pairs of a success of recording r above a failure of recording q; ties are half.
    pairs = np.zeros((count, count))
    for failing in np.unique(owner[~y]):
        failures = np.sort(p[~y & (owner == failing)])
        below = np.searchsorted(failures, successes, "left")
        tied_or_below = np.searchsorted(failures, successes, "right")
        pairs[:, failing] = np.bincount(of, (below + tied_or_below) / 2, count)
    # A resample that has r w_r times and q w_q times has each of their pairs w_r w_q times.
    possible = (weights @ np.bincount(of, minlength=count)) * (
        weights @ np.bincount(owner[~y], minlength=count)
    )
    found: Floats = ((weights @ pairs) * weights).sum(axis=1) / possible
    return found


def _average_precision(p: Floats, y: Mask, owner: Indices, weights: Floats) -> Floats:
    """Sum of precision times the gain in recall, over thresholds from the highest down."""
    # From the most likely down, so that sums to a place are of what lies above a threshold there.
    order = np.argsort(-p, kind="stable")
    y, owner = y[order], owner[order]
    # Equal predictions are taken together: a threshold stands after the last of them.
    ends = np.flatnonzero(np.append(np.diff(p[order]) != 0, p.size > 0))

    def one(weight: Floats) -> float:
        each = weight[owner]
        taken, hits = np.cumsum(each)[ends], np.cumsum(each * y)[ends]
        precision = np.divide(hits, taken, out=np.zeros_like(hits), where=taken > 0)
        return float(np.sum(np.diff(hits, prepend=0) * precision) / hits[-1])

    # A resample without a success, or without a failure, has no score.
    undefined = (weights @ _by_recording(y, owner, weights) == 0) | (
        weights @ _by_recording(~y, owner, weights) == 0
    )
    return np.array([np.nan if bad else one(w) for w, bad in zip(weights, undefined, strict=True)])


def _brier(p: Floats, y: Mask, owner: Indices, weights: Floats) -> Floats:
    squares = _by_recording((p - y) ** 2, owner, weights)
    found: Floats = (weights @ squares) / (weights @ _by_recording(y >= 0, owner, weights))
    return found


def _calibration_error(p: Floats, y: Mask, owner: Indices, weights: Floats) -> Floats:
    bins = calibration_bin(p)
    # gaps[r, b]: sum of probability less label over what recording r has in bin b.
    cells = owner * CALIBRATION_BINS + bins
    count = weights.shape[1]
    gaps = np.bincount(cells, p - y, count * CALIBRATION_BINS).reshape(count, -1)
    # In a resample the gaps of a bin add up over its recordings before their size is taken.
    judged = weights @ _by_recording(y >= 0, owner, weights)
    found: Floats = np.abs(weights @ gaps).sum(axis=1) / judged
    return found


def _by_recording(values: NDArray[np.generic], owner: Indices, weights: Floats) -> Floats:
    return np.bincount(owner, values.astype(np.float64), weights.shape[1]).astype(np.float64)
