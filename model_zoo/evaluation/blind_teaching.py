"""Boosted trees or a line that say how likely each step succeeds; the step is a feature."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import islice
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from sklearn.ensemble import HistGradientBoostingClassifier
from sklearn.linear_model import LogisticRegression
from sklearn.pipeline import Pipeline, make_pipeline
from sklearn.preprocessing import StandardScaler

from graspe_data.arrays import Floats, Floats32, Mask
from model_zoo.evaluation.scenes import scene_areas
from model_zoo.metrics import au_roc

LEAVES: Final = (4, 16)
ITERATIONS: Final = 100
STAGE: Final = 20
"""Trees between two looks at the rows that choose."""
SETTINGS: Final = {
    "max_iter": ITERATIONS,
    "learning_rate": 0.1,
    "min_samples_leaf": 20,
    "l2_regularization": 1.0,
    "early_stopping": False,
    "random_state": 0,
}
_SURE = 1e-3
"""The least share of successes, or of failures, that is believed of rows of one class."""


@dataclass(frozen=True)
class LabelledRows:
    """Features float32 (N, F), labels bool (N, T), and which of them are judged, bool (N, T).

    Of candidates every so many rows, ``of_a_scene``, are of one scene; 1 for driven trajectories.
    """

    features: Floats32
    success: Mask
    mask: Mask
    of_a_scene: int = 1

    def area(self, log_odds: Floats) -> float:
        """AU-ROC of log-odds (N, T): pooled; of candidates the mean within a scene."""
        if self.of_a_scene > 1:
            shape = -1, self.of_a_scene
            labels = self.success.reshape(shape), self.mask.reshape(shape)
            areas = scene_areas(log_odds.reshape(shape), *labels)
            if np.isfinite(areas).any():
                return float(np.nanmean(areas))
        return au_roc(log_odds, self.success, self.mask) or 0.0


@dataclass(frozen=True)
class TaughtReference:
    """A taught reference.

    Attributes:
        model: Boosted trees or a logistic regression; None where the rows that taught were of one
            class.
        trees: How many of the trees are asked; 0 for a regression.
        share: Of successes among the judged steps that taught.
    """

    model: HistGradientBoostingClassifier | Pipeline | None
    trees: int
    share: float

    def log_odds(self, features: Floats32, steps: int) -> Floats:
        """Of success, float64 (N, T).

        Args:
            features: float32 (N, F).
            steps: T.
        """
        if self.model is None or not len(features):
            share = np.clip(self.share, _SURE, 1 - _SURE)
            return np.full((len(features), steps), np.log(share / (1 - share)))
        asked = _with_steps(features, steps)
        if isinstance(self.model, Pipeline):
            found = self.model.decision_function(asked)
        else:
            *_, found = islice(self.model.staged_decision_function(asked), self.trees)
        return np.asarray(found, np.float64).reshape(len(features), steps)


def teach_reference(taught: LabelledRows, chosen: LabelledRows | None = None) -> TaughtReference:
    """Teach a logistic regression and trees of several sizes; keep what ranks ``chosen`` best.

    Few rows teach a line better than a tree. The same rows teach the same.

    Args:
        taught: Rows to learn from.
        chosen: Rows to choose by; without any, or where they are of one class, all of the smallest
            trees are kept.
    """
    success = taught.success[taught.mask]
    share = float(success.mean()) if success.size else 0.5
    if not success.any() or success.all():
        return TaughtReference(None, 0, share)
    asked = _with_steps(taught.features, taught.mask.shape[1])[taught.mask.ravel()]
    forests = [
        HistGradientBoostingClassifier(max_leaf_nodes=leaves, **SETTINGS).fit(asked, success)
        for leaves in LEAVES
    ]
    if chosen is None or not _has_both(chosen):
        return TaughtReference(forests[0], ITERATIONS, share)
    line = make_pipeline(StandardScaler(), LogisticRegression(C=0.1, max_iter=500))
    tried = [TaughtReference(line.fit(asked, success), 0, share)]
    tried += [
        TaughtReference(forest, trees, share)
        for forest in forests
        for trees in range(STAGE, ITERATIONS + 1, STAGE)
    ]
    areas = [area for model in (line, *forests) for area in _areas(model, chosen)]
    # The first of the best, so that a line, and smaller and fewer trees, win a tie.
    return tried[int(np.argmax(areas))]


def _has_both(rows: LabelledRows) -> bool:
    judged = rows.success[rows.mask]
    return bool(judged.any() and not judged.all())


def _areas(
    model: HistGradientBoostingClassifier | Pipeline, chosen: LabelledRows
) -> Iterator[float]:
    """AU-ROC on the rows that choose; of trees after every so many."""
    shape = chosen.mask.shape
    asked = _with_steps(chosen.features, shape[1])
    if isinstance(model, Pipeline):
        stages = [model.decision_function(asked)]
    else:
        stages = list(model.staged_decision_function(asked))[STAGE - 1 :: STAGE]
    for found in stages:
        yield chosen.area(found.reshape(shape))


def _with_steps(features: Floats32, steps: int) -> NDArray[Any]:
    """Features of every step, (N T, F + 1), row by row."""
    step = np.tile(np.arange(steps, dtype=np.float32), len(features))
    return np.column_stack([np.repeat(features, steps, axis=0), step])
