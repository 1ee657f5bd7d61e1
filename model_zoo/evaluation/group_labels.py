"""Which evaluations are repetitions of one training, and what tells such groups apart."""

from __future__ import annotations

from collections.abc import Hashable, Sequence

from model_zoo.evaluation.evaluation import Evaluation

_SHORT = 8
_MOST_VALUES = 3


def group_of(evaluation: Evaluation) -> Hashable:
    """Equal for trainings that differ in the seed alone."""
    recipe = evaluation.recipe and evaluation.recipe.digest
    return evaluation.model, evaluation.preset, recipe, evaluation.trained_on


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
