"""The head of a comparison: what its numbers mean, and how each model was trained."""

from __future__ import annotations

from collections.abc import Sequence

from model_zoo.evaluation.contestants import Contestant
from model_zoo.evaluation.evaluation import Evaluation
from model_zoo.evaluation.parts import ALL_ROWS
from model_zoo.evaluation.score_cells import FEWEST_RECORDINGS
from model_zoo.evaluation.score_tables import markdown_table

_SHORT = 12
_VALUES = ("epochs", "most_steps", "batch_size", "learning_rate")
_NOTE = """\
# Comparison

Written by `graspe zoo compare`, alone or at the end of `graspe zoo run`; `comparison.csv` has every
number, `zoo.yaml` every training.

Split `{split}` of the dataset `{dataset}`: {rows}. Scores are of rows that are not failing yet: a
failure that is under way at the anchor is told by odometry alone. AU-ROC pools their judged steps.
The blind references come first. They have no camera and no cloud, were taught on the training rows
of `{taught_on}`, and had their settings chosen on the validation rows that select. In brackets:
95 % of {resamples} resamples lie within; none are given for fewer than {fewest} recordings. {runs}
Differences are of the same resamples. Bold: the best of a column.
"""
_MANY_RUNS = (
    "Recordings are resampled, and with them the trainings of a model that has several; values are "
    "means over the trainings."
)
_ONE_RUN = (
    "They are intervals over recordings, not over trainings: how far other trainings of a model "
    "would lie from these numbers is seen only from several seeds."
)


def render_heading(models: Sequence[Contestant]) -> str:
    """The title, what the numbers mean, and how each model was trained."""
    first = models[0].runs[0]
    note = _NOTE.format(
        split=first.split,
        dataset=first.dataset[:_SHORT],
        rows=_rows(first),
        resamples=first.resamples,
        fewest=FEWEST_RECORDINGS,
        taught_on=first.references.taught_on[:_SHORT],
        runs=_MANY_RUNS if any(len(model.runs) > 1 for model in models) else _ONE_RUN,
    )
    return f"{note}\n## Trainings\n\n{_trainings(models)}"


def _rows(evaluation: Evaluation) -> str:
    whole = evaluation.cell(condition=evaluation.conditions[0])
    counts = (
        f"{whole.parts[ALL_ROWS].rows:,} rows of {whole.recordings} recordings" if whole else ""
    )
    which = "every judged row" if evaluation.every == 1 else "of the judged rows of a recording one"
    return f"{counts}, {which}" + (f" in {evaluation.every}" if evaluation.every > 1 else "")


def _trainings(models: Sequence[Contestant]) -> str:
    head = ["model", "preset", "trainings", "that chose its settings", "seeds", "steps done"]
    head += ["recipe"]
    head += [name.replace("_", " ") for name in _VALUES]
    return markdown_table([*head, "trained on"], [_training(model) for model in models])


def _training(model: Contestant) -> list[str]:
    first = model.runs[0]
    values = {} if first.recipe is None else first.recipe.values
    return [
        model.label,
        first.preset,
        f"{len(model.runs)}",
        "not said" if first.searched is None else f"{first.searched}",
        _listed([run.seed for run in model.runs]),
        _listed([run.steps for run in model.runs]),
        "unknown" if first.recipe is None else first.recipe.short,
        *(_value(values[name]) if name in values else "-" for name in _VALUES),
        first.trained_on[:_SHORT],
    ]


def _listed(numbers: Sequence[int | None]) -> str:
    return ", ".join("unknown" if number is None else f"{number}" for number in numbers)


def _value(value: object) -> str:
    return "none" if value is None else f"{value}"
