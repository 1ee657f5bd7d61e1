"""Evaluations of a model trained in one way, once or with several seeds, taken together."""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from dataclasses import dataclass
from statistics import fmean

import numpy as np

from graspe_data.arrays import Floats
from model_zoo.evaluation.cell import ALL_SCENARIOS, Score
from model_zoo.evaluation.comparable import check_comparable, check_trainings
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
class Contestant:
    """A model trained in one way, with the evaluations of its trainings.

    Attributes:
        label: How tables and plots call it.
        runs: One evaluation of each training.
    """

    label: str
    runs: tuple[Evaluation, ...]

    def score(self, metric: str, scenario: str, condition: str) -> Score:
        """The mean over the runs of value and bounds; None where a run has none."""
        cells = [run.cell(scenario, condition) for run in self.runs]
        scores = [cell.scores[metric] for cell in cells if cell and metric in cell.scores]
        if len(scores) < len(self.runs):
            return Score(value=None, low=None, high=None)
        return Score(
            value=_mean([score.value for score in scores]),
            low=_mean([score.low for score in scores]),
            high=_mean([score.high for score in scores]),
        )

    def values(self, metric: str, scenario: str, condition: str) -> list[float]:
        """The value of each run that has one."""
        cells = [run.cell(scenario, condition) for run in self.runs]
        values = [cell.scores[metric].value for cell in cells if cell and metric in cell.scores]
        return [value for value in values if value is not None]

    def advantage(self, other: Contestant, scenario: str, condition: str) -> Score:
        """AU-ROC of this one less that of another, over the same resamples of recordings."""
        return _difference((self, scenario, condition), (other, scenario, condition))

    def decline(self, clean: str, condition: str, scenario: str = ALL_SCENARIOS) -> Score:
        """AU-ROC under one condition less that under another, over the same resamples."""
        return _difference((self, scenario, clean), (self, scenario, condition))

    def au_roc_resamples(self, scenario: str, condition: str) -> Floats:
        """AU-ROC of every resample, the mean over the runs; empty for too few recordings."""
        cells = [run.cell(scenario, condition) for run in self.runs]
        drawn = [np.array(cell.au_roc_resamples, dtype=np.float64) for cell in cells if cell]
        mean: Floats = np.mean(drawn, axis=0)
        return mean


_Place = tuple[Contestant, str, str]


def _difference(first: _Place, second: _Place) -> Score:
    values = [model.score("au_roc", *place).value for model, *place in (first, second)]
    if values[0] is None or values[1] is None:
        return Score(value=None, low=None, high=None)
    drawn = [model.au_roc_resamples(*place) for model, *place in (first, second)]
    low, high = interval(drawn[0] - drawn[1])
    return Score(value=values[0] - values[1], low=low, high=high)


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
    return [
        Contestant(label, tuple(runs)) for label, runs in zip(labels, groups.values(), strict=True)
    ]


def _mean(values: Sequence[float | None]) -> float | None:
    known = [value for value in values if value is not None]
    return fmean(known) if len(known) == len(values) else None


def all_and_each(evaluation: Evaluation) -> tuple[str, ...]:
    """All scenarios together, then each."""
    return (ALL_SCENARIOS, *evaluation.scenarios)
