"""The comparison as Markdown: model by scenario, by part of the rows, by condition; costs."""

from __future__ import annotations

from collections.abc import Sequence

from model_zoo.evaluation.blind_features import TITLES
from model_zoo.evaluation.cell import ALL_SCENARIOS, Lead, Score
from model_zoo.evaluation.comparison_heading import render_heading
from model_zoo.evaluation.contestants import Contestant, all_and_each
from model_zoo.evaluation.entrants import Entrant, blind_entrants
from model_zoo.evaluation.evaluation import Evaluation
from model_zoo.evaluation.parts import NOT_FAILING, in_order
from model_zoo.evaluation.parts import TITLES as PART_TITLES
from model_zoo.evaluation.score_tables import emphasised, markdown_table, score_grid, signed

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
    return score_grid(entrants_of(models), columns, lambda m, column: m.au_roc(column, condition))


def entrants_of(models: Sequence[Contestant]) -> list[Entrant]:
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
    return f"{signed(lead)} over {TITLES[lead.reference].removeprefix('blind: ')}"


def _parts(models: Sequence[Contestant]) -> str:
    """The parts in which someone has an AU-ROC; rows that are failing have one class."""
    first, entrants = models[0].runs[0], entrants_of(models)
    condition = first.conditions[0]

    def score(entrant: Entrant, part: str) -> Score:
        return entrant.au_roc(ALL_SCENARIOS, condition, part)

    whole = first.cell(ALL_SCENARIOS, condition)
    parts = in_order(whole.parts if whole else ())
    known = [part for part in parts if any(score(e, part).value is not None for e in entrants)]
    columns = [part for part in known if part != NOT_FAILING]
    return score_grid(entrants, columns, score, titles=[PART_TITLES[part] for part in columns])


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
    return score_grid(
        entrants_of(models), columns, lambda m, column: m.au_roc(ALL_SCENARIOS, column)
    )


def _differences(models: Sequence[Contestant]) -> str:
    columns = all_and_each(models[0].runs[0])
    condition = models[0].runs[0].conditions[0]
    rows = [
        [m.label, *(signed(m.advantage(models[0], column, condition)) for column in columns)]
        for m in models[1:]
    ]
    return markdown_table(["model", *columns], rows)


def _declines(models: Sequence[Contestant]) -> str:
    clean, *columns = models[0].runs[0].conditions

    return score_grid(models, columns, lambda m, c: m.decline(clean, c), higher_is_better=False)


def _others(models: Sequence[Contestant]) -> str:
    condition = models[0].runs[0].conditions[0]
    columns = []
    for metric, (_, higher) in _SCORES.items():
        scores = [model.score(metric, ALL_SCENARIOS, condition) for model in models]
        columns.append(emphasised(scores, higher_is_better=higher))
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
