"""Predictions to scores and curves: each scenario, and all together, with intervals."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from sklearn.metrics import roc_curve

from graspe_data.arrays import Floats, Indices, Mask
from graspe_data.observation.labels import AnchorState
from model_zoo import metrics
from model_zoo.evaluation.bootstrap import draw_weights, resampled_au_roc, resampled_scores
from model_zoo.evaluation.cell import (
    ALL_SCENARIOS,
    ROC_POINTS,
    CalibrationCurve,
    Cell,
    Part,
    ReferenceCell,
    RocCurve,
    StoredScore,
)
from model_zoo.evaluation.judged_split import JudgedSplit
from model_zoo.evaluation.parts import ALL_ROWS, NOT_FAILING, PARTS, TIMES, WITHIN_A_SCENE
from model_zoo.evaluation.scenes import resampled_mean, scene_areas
from model_zoo.metrics import CALIBRATION_BINS, METRICS, calibration_bin

_Labelled = tuple[Floats, Mask, Mask]

_DEFINED_SHARE = 0.5
"""An interval needs the score defined in at least so many of the resamples."""

FEWEST_RECORDINGS = 3
"""Fewer give no interval: their resamples hardly differ."""


@dataclass(frozen=True)
class Said:
    """What a model or a reference says of the rows of a split.

    Attributes:
        log_odds: Of success, (N, T).
        candidates: Of getting through, (N, K); None where rows have no candidates, or where it
            reads no trajectory.
    """

    log_odds: Floats
    candidates: Floats | None = None


def score_cells(
    split: JudgedSplit,
    said: Said,
    condition: str,
    resamples: int,
    seed: int,
    *,
    resampled: bool = True,
) -> list[Cell]:
    """Score all rows together and each scenario.

    Args:
        split: The rows and their labels.
        said: Of these rows.
        condition: For the cells' name.
        resamples: Of recordings.
        seed: Of the resamples: the same for every model, so that they can be compared.
        resampled: Keep the resamples of all scores of all scenarios together.
    """
    return [
        _cell(place, said, condition, resampled=resampled)
        for place in places(split, resamples, seed)
    ]


def score_reference(
    split: JudgedSplit, said: Said, condition: str, resamples: int, seed: int
) -> list[ReferenceCell]:
    """The parts of the same cells, of a blind reference; see :func:`score_cells`."""
    return [
        ReferenceCell(scenario=place.name, condition=condition, parts=_parts(place, said))
        for place in places(split, resamples, seed)
    ]


@dataclass(frozen=True)
class Place:
    """All rows, or those of one scenario.

    Attributes:
        name: Of the scenario, or ``all``.
        split: The rows of the split.
        rows: Which of them, bool (N,).
        recording: (rows,), each in 0 .. R - 1.
        weights: (S, R), how often each recording is drawn in each resample.
    """

    name: str
    split: JudgedSplit
    rows: Mask
    recording: Indices
    weights: Floats

    @property
    def enough(self) -> bool:
        """Whether it has recordings enough for an interval."""
        return bool(self.weights.shape[1] >= FEWEST_RECORDINGS)

    @property
    def parts(self) -> tuple[str, ...]:
        """All together are looked at in every part, a scenario in the two that matter most."""
        return PARTS if self.name == ALL_SCENARIOS else (NOT_FAILING, ALL_ROWS)


def places(split: JudgedSplit, resamples: int, seed: int) -> Iterator[Place]:
    """All rows together, then each scenario."""
    scenario = np.asarray(split.scenarios)[split.recording]
    chosen = {ALL_SCENARIOS: np.ones(scenario.size, bool)}
    chosen |= {name: scenario == name for name in sorted(set(scenario.tolist()))}
    for name, rows in chosen.items():
        recordings, recording = np.unique(split.recording[rows], return_inverse=True)
        weights = draw_weights(recordings.size, resamples, seed, name)
        yield Place(name, split, rows, recording, weights)


def _cell(place: Place, said: Said, condition: str, *, resampled: bool) -> Cell:
    split, rows = place.split, place.rows
    mask = split.part(NOT_FAILING)[rows]
    labelled = (said.log_odds[rows], split.success[rows], mask)
    drawn = resampled_scores(*labelled, place.recording, place.weights)
    if not place.enough:
        drawn = {name: values[:0] for name, values in drawn.items()}
    z, y = metrics.judged_steps(*labelled)
    parts = _parts(place, said)
    kept = resampled and place.name == ALL_SCENARIOS and place.enough
    return Cell(
        scenario=place.name,
        condition=condition,
        recordings=place.weights.shape[1],
        rows=int(np.count_nonzero(mask.any(axis=1))),
        judged=z.size,
        success_share=float(y.mean()) if y.size else None,
        scores={name: _score(score(*labelled), drawn[name]) for name, score in METRICS.items()}
        | {"au_roc": parts[NOT_FAILING].au_roc},
        resamples={n: _listed(drawn[n]) for n in METRICS if n != "au_roc"} if kept else {},
        parts=parts,
        roc=roc(z, y),
        calibration=calibration_curve(metrics.probability(z), y),
    )


def _parts(place: Place, said: Said) -> dict[str, Part]:
    found = {part: _part(place, said, part) for part in place.parts}
    scene = _scene(place, said)
    return found if scene is None else found | {WITHIN_A_SCENE: scene}


def _part(place: Place, said: Said, part: str) -> Part:
    mask = place.split.part(part)[place.rows]
    labelled: _Labelled = (said.log_odds[place.rows], place.split.success[place.rows], mask)
    drawn = resampled_au_roc(*labelled, place.recording, place.weights)
    counted = mask & ~labelled[1] if part in TIMES else mask
    rows = int(np.count_nonzero(counted.any(axis=1)))
    return _made(place, rows, int(mask.sum()), metrics.au_roc(*labelled), drawn)


def _scene(place: Place, said: Said) -> Part | None:
    """The candidates of the rows that are not failing; None where there are none."""
    candidates = place.split.candidates
    if candidates is None or said.candidates is None:
        return None
    sound = place.split.state != AnchorState.FAILING
    areas = scene_areas(said.candidates, candidates.through, candidates.mask)
    areas = np.where(sound, areas, np.nan)[place.rows]
    drawn = resampled_mean(areas, place.recording, place.weights)
    known = np.isfinite(areas)
    value = float(areas[known].mean()) if known.any() else None
    judged = int(candidates.mask[place.rows][known].sum())
    return _made(place, int(known.sum()), judged, value, drawn)


def _made(place: Place, rows: int, judged: int, value: float | None, drawn: Floats) -> Part:
    kept = drawn if place.enough and value is not None else drawn[:0]
    return Part(rows=rows, judged=judged, au_roc=_score(value, kept), resamples=_listed(kept))


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
