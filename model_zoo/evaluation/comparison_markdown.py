"""The comparison as Markdown: what was compared, model by scenario, by condition, scores, costs."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from model_zoo.evaluation.blind_features import TITLES
from model_zoo.evaluation.cell import ALL_SCENARIOS, Lead, Score
from model_zoo.evaluation.contestants import Contestant, all_and_each
from model_zoo.evaluation.entrants import Entrant, blind_entrants
from model_zoo.evaluation.evaluation import Evaluation
from model_zoo.evaluation.parts import ALL_ROWS, NOT_FAILING, in_order
from model_zoo.evaluation.parts import TITLES as PART_TITLES
from model_zoo.evaluation.score_cells import FEWEST_RECORDINGS


def markdown_table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A table; what a text holds of Markdown's or HTML's own signs is shown as it is."""
    lines = [[_escaped(text) for text in line] for line in (head, *rows)]
    lines.insert(1, ["---" for _ in head])
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def _escaped(text: str) -> str:
    plain = " ".join(text.split())
    return plain.replace("|", "\\|").replace("<", "&lt;")


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


_ROWS = "rows not failing yet, clean sensors"
_PARTS_NOTE = """\
All scenarios together. By state at the anchor; by time to failure, the failing steps of rows that
fail in that time against every succeeding step of rows not failing yet; within a scene, the mean
over scenes of the AU-ROC among the trajectories of one row."""
_SCORES = {
    "minimum_au_roc": ("AU-ROC of trajectories", True),
    "average_precision": ("average precision, success", True),
    "failure_average_precision": ("average precision, failure", True),
    "brier": ("Brier", False),
    "expected_calibration_error": ("ECE", False),
}
_MEBIBYTE = 1 << 20


def render_markdown(models: Sequence[Contestant], plots: Sequence[str]) -> str:
    """All tables, and the plots by their paths.

    Args:
        models: What is compared; differences are to the first of them.
        plots: Paths of pictures, relative to the text.
    """
    first = models[0].runs[0]
    parts = [render_heading(models), f"## AU-ROC by scenario, {_ROWS}", _scenarios(models)]
    parts += [_undefined(first), "## Lead over the best blind reference", _leads(models)]
    if len(models) > 1:
        title = f"## AU-ROC less that of {models[0].label}, on the same resamples"
        parts += [title, _differences(models)]
    parts += ["## AU-ROC on other rows, clean sensors", _PARTS_NOTE, _parts(models)]
    if len(first.conditions) > 1:
        parts += ["## AU-ROC by condition of the sensors", _conditions(models)]
        parts += ["## AU-ROC lost to each condition", _declines(models)]
    parts += [f"## Other scores, all scenarios, {_ROWS}", _others(models)]
    parts += ["## Cost of one prediction", _costs(models), "## Data", _data(first)]
    parts += [f"![{plot}]({plot})" for plot in plots]
    return "\n\n".join(part.strip() for part in parts if part) + "\n"


def _scenarios(models: Sequence[Contestant]) -> str:
    columns = all_and_each(models[0].runs[0])
    condition = models[0].runs[0].conditions[0]
    return _grid(_entrants(models), columns, lambda m, column: m.au_roc(column, condition))


def _entrants(models: Sequence[Contestant]) -> list[Entrant]:
    """The blind references, then the models."""
    return [*blind_entrants(models[0].runs[0].references), *models]


def _leads(models: Sequence[Contestant]) -> str:
    first = models[0].runs[0]
    columns = all_and_each(first)
    rows = [
        [m.label, *(_lead(m.lead(first.references, c, first.conditions[0])) for c in columns)]
        for m in models
    ]
    return markdown_table(["model", *columns], rows)


def _lead(lead: Lead | None) -> str:
    if lead is None:
        return "-"
    return f"{_signed(lead)} over {TITLES[lead.reference].removeprefix('blind: ')}"


def _parts(models: Sequence[Contestant]) -> str:
    """The parts in which someone has an AU-ROC; rows that are failing have one class."""
    first, entrants = models[0].runs[0], _entrants(models)
    condition = first.conditions[0]

    def score(entrant: Entrant, part: str) -> Score:
        return entrant.au_roc(ALL_SCENARIOS, condition, part)

    whole = first.cell(ALL_SCENARIOS, condition)
    parts = in_order(whole.parts if whole else ())
    known = [part for part in parts if any(score(e, part).value is not None for e in entrants)]
    columns = [part for part in known if part != NOT_FAILING]
    return _grid(entrants, columns, score, titles=[PART_TITLES[part] for part in columns])


def _undefined(evaluation: Evaluation) -> str:
    """Why a scenario has no AU-ROC."""
    cells = [cell for cell in evaluation.cells if cell.condition == evaluation.conditions[0]]
    lines = [
        f"- {cell.scenario}: AU-ROC undefined: {cell.only_class}"
        for cell in cells
        if cell.only_class is not None
    ]
    return "\n".join(lines)


def _conditions(models: Sequence[Contestant]) -> str:
    columns = models[0].runs[0].conditions
    return _grid(_entrants(models), columns, lambda m, column: m.au_roc(ALL_SCENARIOS, column))


def _differences(models: Sequence[Contestant]) -> str:
    columns = all_and_each(models[0].runs[0])
    condition = models[0].runs[0].conditions[0]
    rows = [
        [m.label, *(_signed(m.advantage(models[0], column, condition)) for column in columns)]
        for m in models[1:]
    ]
    return markdown_table(["model", *columns], rows)


def _declines(models: Sequence[Contestant]) -> str:
    clean, *columns = models[0].runs[0].conditions

    return _grid(models, columns, lambda m, c: m.decline(clean, c), higher_is_better=False)


def _others(models: Sequence[Contestant]) -> str:
    condition = models[0].runs[0].conditions[0]
    columns = []
    for metric, (_, higher) in _SCORES.items():
        scores = [model.score(metric, ALL_SCENARIOS, condition) for model in models]
        columns.append(_emphasise(scores, higher_is_better=higher))
    temperatures = [
        ", ".join("none" if run.temperature is None else f"{run.temperature:.2f}" for run in m.runs)
        for m in models
    ]
    head = ["model", *(title for title, _ in _SCORES.values()), "temperature"]
    labels = [model.label for model in models]
    return markdown_table(
        head, [list(row) for row in zip(labels, *columns, temperatures, strict=True)]
    )


def _costs(models: Sequence[Contestant]) -> str:
    head = ["model", "parameters", "median, ms", "9 of 10 below, ms", "weights, MiB"]
    head += ["beside them, MiB", "device", "threads"]
    return markdown_table(head, [_cost(model) for model in models])


def _cost(model: Contestant) -> list[str]:
    run = model.runs[0]
    latency = run.latency
    working = latency.working_bytes
    return [
        model.label,
        f"{run.parameters:,}",
        f"{latency.median_ms:.1f}",
        f"{latency.p90_ms:.1f}",
        f"{latency.weight_bytes / _MEBIBYTE:.1f}",
        "" if working is None else f"{working / _MEBIBYTE:.1f}",
        latency.device,
        f"{latency.threads}",
    ]


def _data(evaluation: Evaluation) -> str:
    rows = []
    for scenario in all_and_each(evaluation):
        cell = evaluation.cell(scenario, evaluation.conditions[0])
        if cell is not None:
            share = "" if cell.success_share is None else f"{cell.success_share:.1%}"
            counts = (f"{cell.recordings}", f"{cell.rows:,}", f"{cell.judged:,}")
            rows.append([scenario, *counts, share])
    return markdown_table(
        ["scenario", "recordings", "rows not failing yet", "judged steps", "of them success"], rows
    )


def _grid(
    models: Sequence[Entrant],
    columns: Sequence[str],
    score: Callable[[Entrant, str], Score],
    *,
    higher_is_better: bool = True,
    titles: Sequence[str] | None = None,
) -> str:
    texts = [
        _emphasise([score(model, c) for model in models], higher_is_better=higher_is_better)
        for c in columns
    ]
    labels = [model.label for model in models]
    rows = [list(row) for row in zip(labels, *texts, strict=True)]
    return markdown_table(["model", *(titles or columns)], rows)


def _emphasise(scores: Sequence[Score], *, higher_is_better: bool) -> list[str]:
    values = [round(score.value, 3) for score in scores if score.value is not None]
    best = (max if higher_is_better else min)(values, default=None)
    several = len(values) > 1
    return [
        _shown(score, bold=several and score.value is not None and round(score.value, 3) == best)
        for score in scores
    ]


def _shown(score: Score, *, bold: bool = False, form: str = ".3f") -> str:
    if score.value is None:
        return "-"
    value = f"{score.value:{form}}".replace("-0.000", "0.000")
    text = f"**{value}**" if bold else value
    if score.low is None or score.high is None:
        return text
    return f"{text} [{score.low:{form}}, {score.high:{form}}]"


def _signed(score: Score) -> str:
    return _shown(score, form="+.3f")
