"""The head of a comparison: what was compared on which rows, and what the numbers mean."""

from __future__ import annotations

from collections.abc import Sequence

from model_zoo.evaluation.contestants import Contestant
from model_zoo.evaluation.evaluation import Evaluation
from model_zoo.evaluation.markdown_table import markdown_table
from model_zoo.evaluation.score_cells import FEWEST_RECORDINGS

_SHORT = 12
_VALUES = ("epochs", "most_steps", "batch_size", "learning_rate")
_NOTE = """\
# Comparison

Written by `graspe zoo compare`, alone or at the end of `graspe zoo run`; `comparison.csv` has every
number, `zoo.yaml` every training.

Split `{split}` of the dataset `{dataset}`: {rows}. AU-ROC pools all judged steps. In brackets: 95 %
of {resamples} resamples of recordings lie within; none are given for fewer than {fewest}
recordings. They are intervals over recordings, not over trainings: how far other trainings of a
model would lie from these numbers is seen only from several seeds. {runs}Bold: the best of a
column.
"""
_MANY_RUNS = "Values and bounds are means over the trainings of a model. "


def render_heading(models: Sequence[Contestant]) -> str:
    """The title, what the numbers mean, and how each model was trained."""
    first = models[0].runs[0]
    note = _NOTE.format(
        split=first.split,
        dataset=first.dataset[:_SHORT],
        rows=_rows(first),
        resamples=first.resamples,
        fewest=FEWEST_RECORDINGS,
        runs=_MANY_RUNS if any(len(model.runs) > 1 for model in models) else "",
    )
    return f"{note}\n## Trainings\n\n{_trainings(models)}"


def _rows(evaluation: Evaluation) -> str:
    whole = evaluation.cell(condition=evaluation.conditions[0])
    counts = f"{whole.rows:,} rows of {whole.recordings} recordings" if whole else ""
    which = "every judged row" if evaluation.every == 1 else "of the judged rows of a recording one"
    return f"{counts}, {which}" + (f" in {evaluation.every}" if evaluation.every > 1 else "")


def _trainings(models: Sequence[Contestant]) -> str:
    head = ["model", "preset", "trainings", "seeds", "steps done", "recipe"]
    head += [name.replace("_", " ") for name in _VALUES]
    return markdown_table([*head, "trained on"], [_training(model) for model in models])


def _training(model: Contestant) -> list[str]:
    first = model.runs[0]
    values = {} if first.recipe is None else first.recipe.values
    return [
        model.label,
        first.preset,
        f"{len(model.runs)}",
        _listed([run.seed for run in model.runs]),
        _listed([run.steps for run in model.runs]),
        "unknown" if first.recipe is None else first.recipe.short,
        *(_shown(values[name]) if name in values else "-" for name in _VALUES),
        first.trained_on[:_SHORT],
    ]


def _listed(numbers: Sequence[int | None]) -> str:
    return ", ".join("unknown" if number is None else f"{number}" for number in numbers)


def _shown(value: object) -> str:
    return "none" if value is None else f"{value}"
