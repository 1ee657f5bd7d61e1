"""Evaluations of a model trained in one way, once or with several seeds, taken together."""

from __future__ import annotations

import hashlib
from collections.abc import Hashable, Sequence
from dataclasses import dataclass
from statistics import fmean
from typing import Self

import numpy as np

from model_zoo.evaluation.blind_references import as_array
from model_zoo.evaluation.bootstrap import joint_resamples
from model_zoo.evaluation.cell import ALL_SCENARIOS, Score
from model_zoo.evaluation.comparable import check_comparable, check_trainings
from model_zoo.evaluation.entrants import UNDEFINED, Entrant
from model_zoo.evaluation.evaluation import Evaluation
from model_zoo.evaluation.score_cells import interval

_SHORT = 8
_MOST_VALUES = 3


def group_of(evaluation: Evaluation) -> Hashable:
    """Equal for trainings that differ in the seed alone."""
    recipe = evaluation.recipe and evaluation.recipe.digest
    ranks = evaluation.ranks or 1
    return evaluation.model, evaluation.preset, recipe, evaluation.trained_on, ranks


def label_groups(groups: Sequence[Evaluation]) -> list[str]:
    """A label for each group: the model, and what tells it from the other groups.

    Args:
        groups: One evaluation of each.
    """
    presets = len({group.preset for group in groups}) > 1
    return [_label(group, groups, preset=presets) for group in groups]


def _label(group: Evaluation, groups: Sequence[Evaluation], *, preset: bool) -> str:
    own = (group.model, group.preset)
    rivals = [other for other in groups if (other.model, other.preset) == own]
    details = [group.preset] if preset else []
    if len({other.recipe and other.recipe.digest for other in rivals}) > 1:
        details.append(_recipe(group, rivals))
    if len({other.ranks or 1 for other in rivals}) > 1:
        details.append(f"ranks {group.ranks or 1}")
    if len({other.trained_on for other in rivals}) > 1:
        details.append(f"data {group.trained_on[:_SHORT]}")
    return f"{group.model} ({', '.join(details)})" if details else group.model


def _recipe(group: Evaluation, rivals: Sequence[Evaluation]) -> str:
    """The values in which recipes differ where they are few, else the recipe's digest."""
    if group.recipe is None:
        return "recipe unknown"
    own = group.recipe.values
    known = [rival.recipe.values for rival in rivals if rival.recipe is not None]
    names = sorted({name for values in known for name in values})
    telling = [name for name in names if len({repr(v.get(name)) for v in known}) > 1]
    if not 0 < len(telling) <= _MOST_VALUES:
        return f"recipe {group.recipe.short}"
    return ", ".join(f"{name} {_shown(own.get(name))}" for name in telling)


def _shown(value: object) -> str:
    return "none" if value is None else str(value)


@dataclass(frozen=True)
class Contestant(Entrant):
    """A model trained in one way, with the evaluations of its trainings.

    Attributes:
        runs: One evaluation of each training.
    """

    runs: tuple[Evaluation, ...]

    @classmethod
    def of(cls, label: str, runs: Sequence[Evaluation]) -> Self:
        """A model by the evaluations of its trainings."""
        checkpoints = ",".join(sorted(run.checkpoint for run in runs))
        seed = int.from_bytes(hashlib.sha256(checkpoints.encode()).digest()[:8], "big")
        return cls(label, runs, seed, tuple(runs))

    def score(self, metric: str, scenario: str, condition: str) -> Score:
        """A score on rows not failing yet: the mean over the trainings, and its interval.

        None where a training has no such score. Of several trainings there is an interval where
        the resamples of the score were kept.
        """
        if metric == "au_roc":
            return self.au_roc(scenario, condition)
        values = self.values(metric, scenario, condition)
        if len(values) < len(self.runs):
            return UNDEFINED
        cells = [cell for run in self.runs if (cell := run.cell(scenario, condition))]
        if len(self.runs) == 1:
            return cells[0].scores[metric]
        kept = [as_array(cell.resamples.get(metric, ())) for cell in cells]
        low, high = interval(joint_resamples(np.array(kept), self.seed))
        return Score(value=fmean(values), low=low, high=high)

    def values(self, metric: str, scenario: str, condition: str) -> list[float]:
        """The value of each training that has one."""
        cells = [run.cell(scenario, condition) for run in self.runs]
        values = [cell.scores[metric].value for cell in cells if cell and metric in cell.scores]
        return [value for value in values if value is not None]


def contestants(evaluations: Sequence[Evaluation]) -> list[Contestant]:
    """Group evaluations by model, preset, recipe and training data, in the order first met.

    Raises:
        ZooError: They cannot be compared, or two of a group are not trainings of their own.
    """
    check_comparable(evaluations)
    groups: dict[Hashable, list[Evaluation]] = {}
    for evaluation in evaluations:
        groups.setdefault(group_of(evaluation), []).append(evaluation)
    for runs in groups.values():
        check_trainings(runs)
    labels = label_groups([runs[0] for runs in groups.values()])
    return [Contestant.of(label, runs) for label, runs in zip(labels, groups.values(), strict=True)]


def all_and_each(evaluation: Evaluation) -> tuple[str, ...]:
    """All scenarios together, then each."""
    return (ALL_SCENARIOS, *evaluation.scenarios)
