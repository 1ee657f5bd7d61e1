"""Evaluations to tables and plots; nothing is trained or predicted."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from io import StringIO
from pathlib import Path
from typing import Any

from graspe_data.atomic_file import write_atomically
from graspe_data.errors import ZooError
from model_zoo.evaluation.comparison_markdown import render_markdown
from model_zoo.evaluation.contestants import Contestant, all_and_each, contestants
from model_zoo.evaluation.entrants import Entrant, blind_entrants
from model_zoo.evaluation.evaluation import Evaluation
from model_zoo.evaluation.parts import NOT_FAILING
from model_zoo.evaluation.plots import plot_calibration, plot_conditions, plot_roc
from model_zoo.evaluation.zoo_index import INDEX_NAME, index_of, render_index
from model_zoo.metrics import METRICS


def compare(evaluations: Sequence[Evaluation], out: Path) -> Path:
    """Write ``comparison.md``, ``comparison.csv``, ``zoo.yaml`` and the plots, each atomically.

    Args:
        evaluations: Of the same rows; several of one model and preset (other seeds) are averaged.
            Differences are to the first.
        out: Folder, made if it is not there.

    Returns:
        The path of ``comparison.md``.

    Raises:
        ZooError: The evaluations cannot be compared, or the folder cannot be written.
    """
    models = contestants(evaluations)
    plots = {"roc.png": plot_roc(models), "calibration.png": plot_calibration(models)}
    if len(evaluations[0].conditions) > 1:
        plots["conditions.png"] = plot_conditions(models)
    files = plots | {
        "comparison.csv": render_csv(models).encode(),
        "comparison.md": render_markdown(models, list(plots)).encode(),
        INDEX_NAME: render_index(index_of(evaluations)).encode(),
    }
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ZooError(f"{out}: cannot be made: {error.strerror}.") from error
    for name, content in files.items():
        write_atomically(out / name, [content], ZooError)
    return out / "comparison.md"


_FIELDS = (
    "model",
    "preset",
    "recipe",
    "trained_on",
    "split",
    "every",
    "runs",
    "scenario",
    "condition",
    "rows",
    "metric",
    "reference",
    "value",
    "low",
    "high",
    "least_run",
    "greatest_run",
    "recordings",
)
_COSTS = ("median_ms", "p90_ms", "weight_bytes", "working_bytes")


def comparison_records(models: Sequence[Contestant]) -> list[dict[str, Any]]:
    """A record for each score; costs have no scenario.

    The blind references come first. Trainings of one model, preset, recipe and dataset are taken
    together. ``low`` and ``high`` bound 95 % of the resamples of trainings and recordings;
    ``least_run`` and ``greatest_run`` are the extremes of the trainings. ``rows`` names the part of
    the rows, ``lead`` is the AU-ROC less that of the best blind reference there.
    """
    first = models[0].runs[0]
    blind = [
        record
        for entrant in blind_entrants(first.references)
        for record in _areas(entrant, first, {"model": entrant.label})
    ]
    return blind + [record for model in models for record in _records(model)]


def _records(model: Contestant) -> list[dict[str, Any]]:
    first, head = model.runs[0], _head(model)
    areas = _areas(model, first, head)
    return [*_scores(model), *areas, *_leads(model, head), *_costs(model)]


def _areas(entrant: Entrant, first: Evaluation, head: dict[str, Any]) -> list[dict[str, Any]]:
    """AU-ROC of each part; that of a model's rows not failing yet stands among its scores."""
    return [
        head
        | {"scenario": cell.scenario, "condition": cell.condition, "rows": part}
        | {"metric": "au_roc", "recordings": cell.recordings}
        | entrant.au_roc(cell.scenario, cell.condition, part).model_dump()
        for cell in first.cells
        for part in cell.parts
        if not (isinstance(entrant, Contestant) and part == NOT_FAILING)
    ]


def _leads(model: Contestant, head: dict[str, Any]) -> list[dict[str, Any]]:
    first = model.runs[0]
    return [
        head
        | {"scenario": cell.scenario, "condition": cell.condition, "rows": part, "metric": "lead"}
        | lead.model_dump()
        for cell in first.cells
        for part in cell.parts
        if (lead := model.lead(first.references, cell.scenario, cell.condition, part))
    ]


def render_csv(models: Sequence[Contestant]) -> str:
    """The records as CSV; empty where there is no number."""
    text = StringIO()
    writer = csv.DictWriter(text, _FIELDS, lineterminator="\n", restval="")
    writer.writeheader()
    writer.writerows(comparison_records(models))
    return text.getvalue()


def _head(model: Contestant) -> dict[str, Any]:
    first = model.runs[0]
    return {
        "model": first.model,
        "preset": first.preset,
        "recipe": "" if first.recipe is None else first.recipe.digest,
        "trained_on": first.trained_on,
        "split": first.split,
        "every": first.every,
        "runs": len(model.runs),
    }


def _scores(model: Contestant) -> list[dict[str, Any]]:
    first = model.runs[0]
    places = [(s, c) for s in all_and_each(first) for c in first.conditions]
    return [
        _head(model)
        | {"scenario": scenario, "condition": condition, "metric": metric, "rows": NOT_FAILING}
        | model.score(metric, scenario, condition).model_dump()
        | _extremes(model.values(metric, scenario, condition))
        | _recordings(first, scenario, condition)
        for scenario, condition in places
        for metric in METRICS
    ]


def _recordings(evaluation: Evaluation, scenario: str, condition: str) -> dict[str, int]:
    cell = evaluation.cell(scenario, condition)
    return {} if cell is None else {"recordings": cell.recordings}


def _extremes(values: Sequence[float]) -> dict[str, float]:
    return {"least_run": min(values), "greatest_run": max(values)} if values else {}


def _costs(model: Contestant) -> list[dict[str, Any]]:
    first = model.runs[0]
    costs = [{"metric": "parameters", "value": first.parameters}]
    costs += [{"metric": name, "value": getattr(first.latency, name)} for name in _COSTS]
    return [_head(model) | cost for cost in costs]
