"""Plots of a comparison: ROC and calibration curves, and AU-ROC by condition."""

from __future__ import annotations

from collections.abc import Sequence
from io import BytesIO
from math import ceil

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from model_zoo.evaluation.cell import ALL_SCENARIOS
from model_zoo.evaluation.contestants import Contestant, all_and_each
from model_zoo.evaluation.evaluation import Evaluation

_COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#000000")
"""Of Okabe and Ito: told apart by colour-blind readers."""
_PANELS_A_ROW = 3
_PANEL_INCHES = 3.4
_DOTS_PER_INCH = 120
_TITLE_SIZE = 9
_LONGEST_NAME = 48
_LEAST_RANGE = (0.45, 0.85)
"""Of AU-ROC on an axis, so that differences of no weight look small."""


def plot_roc(models: Sequence[Contestant]) -> bytes:
    """ROC curves, clean sensors: a panel for each scenario. Of several runs the mean curve."""
    first = models[0].runs[0]
    figure, panels = _panels(len(all_and_each(first)))
    for axes, scenario in zip(panels, all_and_each(first), strict=True):
        axes.plot([0, 1], [0, 1], color="#bbbbbb", linewidth=1)
        for model, colour in _coloured(models):
            _draw_roc(axes, model, colour, scenario)
        axes.set_title(_drawn(scenario), fontsize=_TITLE_SIZE)
        axes.set(xlabel="failures accepted", ylabel="successes accepted")
        axes.set(xlim=(0, 1), ylim=(0, 1.01), aspect="equal")
        if axes.get_legend_handles_labels()[0]:
            axes.legend(fontsize=7, loc="lower right", frameon=False)
        else:
            axes.text(0.5, 0.5, _undefined(first, scenario), ha="center", fontsize=7)
    return _png(figure)


def plot_calibration(models: Sequence[Contestant]) -> bytes:
    """Share of successes against predicted probability, clean sensors: a panel for each model."""
    figure, panels = _panels(len(models))
    for axes, (model, colour) in zip(panels, _coloured(models), strict=True):
        axes.plot([0, 1], [0, 1], color="#bbbbbb", linewidth=1)
        _draw_calibration(axes, model, colour)
        error = model.score("expected_calibration_error", ALL_SCENARIOS, _clean(model)).value
        shown = "" if error is None else f", ECE {error:.3f}"
        axes.set_title(f"{_drawn(model.label)}{shown}", fontsize=_TITLE_SIZE)
        axes.set(xlabel="predicted probability of success", ylabel="share of successes")
        axes.set(xlim=(0, 1), ylim=(0, 1.01), aspect="equal")
    figure.supxlabel("areas of the dots: share of the judged steps", fontsize=8)
    return _png(figure)


def plot_conditions(models: Sequence[Contestant]) -> bytes:
    """AU-ROC of all scenarios together under each condition, with intervals."""
    conditions = models[0].runs[0].conditions
    figure = Figure(figsize=(1.5 + 1.6 * len(conditions), 3.6), layout="constrained")
    axes = figure.subplots()
    width = 0.8 / len(models)
    for place, (model, colour) in enumerate(_coloured(models)):
        scores = [model.score("au_roc", ALL_SCENARIOS, c) for c in conditions]
        at = np.arange(len(conditions)) + (place - (len(models) - 1) / 2) * width
        values = np.array([np.nan if s.value is None else s.value for s in scores])
        lows = np.array([np.nan if s.low is None else s.low for s in scores])
        highs = np.array([np.nan if s.high is None else s.high for s in scores])
        axes.vlines(at, lows, highs, color=colour, linewidth=1.5)
        axes.plot(at, values, "o", color=colour, markersize=5, label=_drawn(model.label))
    axes.axhline(0.5, color="#bbbbbb", linewidth=1)
    axes.set_xticks(range(len(conditions)), [c.replace("_", " ") for c in conditions])
    bottom, top = axes.get_ylim()
    axes.set_ylim(min(bottom, _LEAST_RANGE[0]), max(top, _LEAST_RANGE[1]))
    axes.set(ylabel="AU-ROC", xlim=(-0.5, len(conditions) - 0.5))
    axes.legend(fontsize=8, loc="upper left", bbox_to_anchor=(1, 1), frameon=False)
    axes.spines[["top", "right"]].set_visible(False)
    return _png(figure)


def _draw_roc(axes: Axes, model: Contestant, colour: str, scenario: str) -> None:
    cells = [run.cell(scenario, _clean(model)) for run in model.runs]
    curves = [cell.roc for cell in cells if cell and cell.roc]
    area = model.score("au_roc", scenario, _clean(model)).value
    if curves and area is not None:
        heights = np.mean([curve.true_positive for curve in curves], axis=0)
        label = f"{_drawn(model.label)} {area:.3f}"
        axes.plot(curves[0].false_positive, heights, color=colour, linewidth=1.5, label=label)


def _draw_calibration(axes: Axes, model: Contestant, colour: str) -> None:
    for run in model.runs:
        cell = run.cell(ALL_SCENARIOS, _clean(model))
        if cell is not None and cell.judged:
            curve = cell.calibration
            axes.plot(curve.probability, curve.success, color=colour, linewidth=1)
            sizes = 300 * np.array(curve.judged) / cell.judged
            axes.scatter(curve.probability, curve.success, sizes + 2, color=colour, alpha=0.6)


def _undefined(evaluation: Evaluation, scenario: str) -> str:
    cell = evaluation.cell(scenario, evaluation.conditions[0])
    reason = cell.only_class if cell else None
    return "AU-ROC undefined" + (f":\n{reason}" if reason else "")


def _drawn(text: str) -> str:
    """A name as matplotlib takes it: no formula, in one line, not longer than a panel is wide."""
    line = " ".join(text.split())
    short = line if len(line) <= _LONGEST_NAME else line[: _LONGEST_NAME - 1] + "…"
    return short.replace("$", r"\$").lstrip("_")


def _clean(model: Contestant) -> str:
    return model.runs[0].conditions[0]


def _coloured(models: Sequence[Contestant]) -> list[tuple[Contestant, str]]:
    return [(model, _COLOURS[k % len(_COLOURS)]) for k, model in enumerate(models)]


def _panels(count: int) -> tuple[Figure, list[Axes]]:
    across = min(count, _PANELS_A_ROW)
    down = ceil(count / across)
    size = (_PANEL_INCHES * across, (_PANEL_INCHES + 0.2) * down + 0.3)
    figure = Figure(figsize=size, layout="constrained")
    panels = list(figure.subplots(down, across, squeeze=False).flat)
    for axes in panels:
        axes.spines[["top", "right"]].set_visible(False)
        axes.xaxis.label.set_fontsize(8)
        axes.yaxis.label.set_fontsize(8)
        axes.tick_params(labelsize=7)
    for unused in panels[count:]:
        unused.remove()
    return figure, panels[:count]


def _png(figure: Figure) -> bytes:
    content = BytesIO()
    FigureCanvasAgg(figure)
    figure.savefig(content, format="png", dpi=_DOTS_PER_INCH, metadata={"Software": None})
    return content.getvalue()
