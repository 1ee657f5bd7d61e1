"""The index of a zoo: which trainings there are, what they scored, by which digests to know them.

``manifests/zoo.yaml`` is that of the comparison in the README.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Annotated, Literal

import yaml
from pydantic import Field

from graspe_data.manifest import Settings, load_manifest, shipped_manifests
from model_zoo.evaluation.cell import Cell, ReferenceCell
from model_zoo.evaluation.contestants import all_and_each
from model_zoo.evaluation.evaluation import Evaluation
from model_zoo.evaluation.parts import NOT_FAILING

INDEX_NAME = "zoo.yaml"

_HEADING = """\
# Written by `graspe zoo compare`, alone or at the end of `graspe zoo run`: every training, its
# checkpoint's digest and its AU-ROC.
"""

AuRoc = Annotated[float, Field(ge=0, le=1)] | None


class IndexEntry(Settings):
    """One training.

    Attributes:
        model: Name of the model.
        preset: Its preset.
        seed: Of the training.
        recipe: Digest of its recipe without the seed; None where it is not known.
        searched: Trainings that chose its settings; None where it is not said.
        steps: That it did; None where it is not known.
        parameters: Numbers in the model.
        checkpoint: Digest of the checkpoint.
        trained_on: Digest of the dataset.
        latency_ms: Median of one prediction where it was evaluated.
        au_roc: Pooled over the rows that the index names, with clean sensors, of every scenario and
            of all together.
        au_roc_by_condition: Pooled over all scenarios, under each condition of the sensors.
    """

    model: str
    preset: str
    seed: int | None
    recipe: str | None = None
    searched: int | None = None
    steps: int | None = None
    parameters: int
    checkpoint: str
    trained_on: str
    latency_ms: float
    au_roc: dict[str, AuRoc]
    au_roc_by_condition: dict[str, AuRoc]


class ZooIndex(Settings):
    """All trainings of a comparison, on the same rows.

    Attributes:
        evaluated_on: Digest of the dataset.
        split: Its rows.
        every: Of the judged rows of a recording, every so many were taken.
        rows: Which of them the scores are of; ``all_rows`` in an index of older evaluations.
        references: AU-ROC of each blind reference, of every scenario and of all together.
        trainings: One entry each.
    """

    evaluated_on: str
    split: str
    every: int
    rows: Literal["all_rows", "not_failing"] = "all_rows"
    references: Mapping[str, Mapping[str, AuRoc]] = {}
    trainings: tuple[IndexEntry, ...]

    def mean_au_roc(self, model: str, preset: str) -> float | None:
        """The mean over the trainings of a model, all scenarios together; None without any."""
        found = [
            entry.au_roc["all"]
            for entry in self.trainings
            if (entry.model, entry.preset) == (model, preset)
        ]
        known = [value for value in found if value is not None]
        return sum(known) / len(known) if known else None


def index_of(evaluations: Sequence[Evaluation]) -> ZooIndex:
    """The index of evaluations that can be compared; at least one."""
    first = evaluations[0]
    return ZooIndex(
        evaluated_on=first.dataset,
        split=first.split,
        every=first.every,
        rows="not_failing",
        references={
            reference.name: {name: _area(reference.cell(name)) for name in all_and_each(first)}
            for reference in first.references.scores
        },
        trainings=tuple(_entry(evaluation) for evaluation in evaluations),
    )


def render_index(index: ZooIndex) -> str:
    """The index as YAML."""
    return _HEADING + yaml.safe_dump(index.model_dump(mode="json"), sort_keys=False, width=100)


def shipped_index() -> ZooIndex:
    """The index that ships.

    Raises:
        ManifestError: The file is missing or does not validate.
    """
    return load_manifest(shipped_manifests() / INDEX_NAME, ZooIndex)


def _entry(evaluation: Evaluation) -> IndexEntry:
    return IndexEntry(
        model=evaluation.model,
        preset=evaluation.preset,
        seed=evaluation.seed,
        recipe=None if evaluation.recipe is None else evaluation.recipe.digest,
        searched=evaluation.searched,
        steps=evaluation.steps,
        parameters=evaluation.parameters,
        checkpoint=evaluation.checkpoint,
        trained_on=evaluation.trained_on,
        latency_ms=round(evaluation.latency.median_ms, 1),
        au_roc={name: _au_roc(evaluation, name) for name in all_and_each(evaluation)},
        au_roc_by_condition={
            name: _au_roc(evaluation, "all", name) for name in evaluation.conditions
        },
    )


def _au_roc(evaluation: Evaluation, scenario: str, condition: str = "clean") -> float | None:
    return _area(evaluation.cell(scenario, condition))


def _area(cell: Cell | ReferenceCell | None) -> float | None:
    value = None if cell is None else cell.parts[NOT_FAILING].au_roc.value
    return None if value is None else round(value, 4)
