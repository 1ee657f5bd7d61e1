"""Whether evaluations can be compared: of the same rows, each of a training of its own."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import zip_longest

from graspe_data.errors import ZooError
from model_zoo.evaluation.blind_references import ReferenceScores
from model_zoo.evaluation.cell import Cell
from model_zoo.evaluation.evaluation import Evaluation
from model_zoo.evaluation.parts import NOT_FAILING

_SHORT = 12
_REFERENCES_APART = 0.01
"""Of AU-ROC, between references that are the same."""
_SETTINGS = ("dataset", "split", "scenarios", "conditions", "resamples", "resample_seed", "every")
_COUNTS = ("recordings", "rows", "judged", "success_share")


def check_comparable(evaluations: Sequence[Evaluation]) -> None:
    """Refuse evaluations that are not of the same rows.

    Raises:
        ZooError: None are given, one is given twice, or they are of other data, another split,
            other scenarios, conditions, resamples, rows or blind references.
    """
    if not evaluations:
        raise ZooError("compare: no evaluations given.")
    seen: set[str] = set()
    for evaluation in evaluations:
        _refuse_other_settings(evaluation, evaluations[0])
        _refuse_other_rows(evaluation, evaluations[0])
        _refuse_other_references(evaluation, evaluations[0])
        if evaluation.checkpoint in seen:
            raise ZooError(f"compare: {_name(evaluation)} is given twice.")
        seen.add(evaluation.checkpoint)


def check_trainings(runs: Sequence[Evaluation]) -> None:
    """Refuse trainings of one model, recipe and dataset that are not repetitions of each other.

    Raises:
        ZooError: Two have the same seed, other settings, or other numbers of parameters.
    """
    by_seed: dict[int, Evaluation] = {}
    for run in runs:
        if run.parameters != runs[0].parameters:
            raise ZooError(
                f"compare: {_name(run)} and {_name(runs[0])} differ in parameters: "
                f"{run.parameters} and {runs[0].parameters}, so they are not one model. Compare "
                "them apart, or train one of them again."
            )
        if None not in (run.settings, runs[0].settings) and run.settings != runs[0].settings:
            raise ZooError(
                f"compare: {_name(run)} and {_name(runs[0])} were made with other settings under "
                "the name of one preset, so they are not one model. Compare them apart, or train "
                "one of them again."
            )
        if run.seed is not None and run.seed in by_seed:
            _refuse_same_seed(run, by_seed[run.seed])
        if run.seed is not None:
            by_seed[run.seed] = run


def _refuse_same_seed(run: Evaluation, other: Evaluation) -> None:
    both = f"{other.checkpoint[:_SHORT]} and {run.checkpoint[:_SHORT]}"
    if run.recipe is None:
        why = "by recipes that their evaluations do not tell. Evaluate both again"
    else:
        why = "on one dataset by one recipe. Give one of them, or train with another seed"
    raise ZooError(f"compare: {_name(run)} is there twice, as checkpoints {both}, trained {why}.")


def _refuse_other_settings(evaluation: Evaluation, first: Evaluation) -> None:
    for what in _SETTINGS:
        found, expected = getattr(evaluation, what), getattr(first, what)
        if found != expected:
            raise ZooError(
                f"compare: {_name(evaluation)} and {_name(first)} differ in {what}: {found} and "
                f"{expected}. Evaluate both with the same settings on the same data."
            )


def _refuse_other_rows(evaluation: Evaluation, first: Evaluation) -> None:
    for expected in first.cells:
        found = evaluation.cell(expected.scenario, expected.condition)
        if found is not None and _counts(found) != _counts(expected):
            raise ZooError(
                f"compare: {_name(evaluation)} and {_name(first)} differ in the rows of "
                f"{expected.scenario!r} under {expected.condition!r}: {_counts_text(found)}; "
                f"{_counts_text(expected)}. Evaluate both again."
            )


def _refuse_other_references(evaluation: Evaluation, first: Evaluation) -> None:
    """The same rows give the same references, but for what a release of scikit-learn changes."""
    found, expected = evaluation.references, first.references
    fault = "taught on other data" if found.taught_on != expected.taught_on else ""
    for one, other in zip_longest(found.scores, expected.scores):
        if one is None or other is None or one.name != other.name:
            fault = fault or "others in number or name"
            break
        areas = [_area(reference) for reference in (one, other)]
        if abs(areas[0] - areas[1]) > _REFERENCES_APART:
            fault = fault or f"{one.name} has an AU-ROC of {areas[0]:.4f} and {areas[1]:.4f}"
    if fault:
        raise ZooError(
            f"compare: {_name(evaluation)} and {_name(first)} differ in their blind references: "
            f"{fault}. Evaluate both again, with the same --references."
        )


def _area(reference: ReferenceScores) -> float:
    cell = reference.cell()
    value = None if cell is None else cell.parts[NOT_FAILING].au_roc.value
    return 0.0 if value is None else value


def _counts(cell: Cell) -> tuple[object, ...]:
    return (*(getattr(cell, name) for name in _COUNTS), len(cell.parts[NOT_FAILING].resamples))


def _counts_text(cell: Cell) -> str:
    counts = ", ".join(f"{name} {getattr(cell, name)}" for name in _COUNTS)
    return f"{counts}, {len(cell.parts[NOT_FAILING].resamples)} resamples"


def _name(evaluation: Evaluation) -> str:
    seed = "" if evaluation.seed is None else f", seed {evaluation.seed}"
    return f"{evaluation.model} ({evaluation.preset}{seed})"
