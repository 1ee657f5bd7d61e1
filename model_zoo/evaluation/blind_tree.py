"""Boosted trees that say of each step how likely it succeeds; the step is one of their features."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import islice
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from sklearn.ensemble import HistGradientBoostingClassifier

from graspe_data.arrays import Floats, Floats32, Mask
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
    """Features float32 (N, F), labels bool (N, T), and which of them are judged, bool (N, T)."""

    features: Floats32
    success: Mask
    mask: Mask


@dataclass(frozen=True)
class BlindTree:
    """A taught reference.

    Attributes:
        model: The trees; None where the rows that taught were of one class.
        iterations: How many of them are asked.
        share: Of successes among the judged steps that taught.
        settings_tried: How many settings were compared on the rows that choose.
    """

    model: HistGradientBoostingClassifier | None
    iterations: int
    share: float
    settings_tried: int

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
        *_, found = islice(self.model.staged_decision_function(asked), self.iterations)
        return np.asarray(found, np.float64).reshape(len(features), steps)


def teach_tree(taught: LabelledRows, chosen: LabelledRows | None = None) -> BlindTree:
    """Teach trees of several sizes; keep the size and number that rank the rows ``chosen`` best.

    The same rows give the same trees.

    Args:
        taught: Rows to learn from.
        chosen: Rows to choose by; without any, or where they are of one class, all of the smallest
            trees are kept.
    """
    success = taught.success[taught.mask]
    share = float(success.mean()) if success.size else 0.5
    if not success.any() or success.all():
        return BlindTree(None, 0, share, 0)
    asked = _with_steps(taught.features, taught.mask.shape[1])[taught.mask.ravel()]
    models = [
        HistGradientBoostingClassifier(max_leaf_nodes=leaves, **SETTINGS).fit(asked, success)
        for leaves in LEAVES
    ]
    if chosen is None or not _has_both(chosen):
        return BlindTree(models[0], ITERATIONS, share, 0)
    tried = [(area, place, n) for place, m in enumerate(models) for area, n in _areas(m, chosen)]
    # The first of the best: smaller and fewer trees win a tie.
    _, place, iterations = max(tried, key=lambda one: (one[0], -one[1], -one[2]))
    return BlindTree(models[place], iterations, share, len(tried))


def _has_both(rows: LabelledRows) -> bool:
    judged = rows.success[rows.mask]
    return bool(judged.any() and not judged.all())


def _areas(
    model: HistGradientBoostingClassifier, chosen: LabelledRows
) -> Iterator[tuple[float, int]]:
    """AU-ROC on the rows that choose, after every so many trees."""
    shape = chosen.mask.shape
    stages = model.staged_decision_function(_with_steps(chosen.features, shape[1]))
    for number, found in enumerate(stages, start=1):
        if number % STAGE == 0:
            yield au_roc(found.reshape(shape), chosen.success, chosen.mask) or 0.0, number


def _with_steps(features: Floats32, steps: int) -> NDArray[Any]:
    """Features of every step, (N T, F + 1), row by row."""
    step = np.tile(np.arange(steps, dtype=np.float32), len(features))
    return np.column_stack([np.repeat(features, steps, axis=0), step])
