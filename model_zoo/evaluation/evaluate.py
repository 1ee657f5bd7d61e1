"""Evaluate a checkpoint on a split of a dataset."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import torch

from graspe_data.progress import Progress, Silent
from graspe_data.shards.dataset_index import read_index
from model_zoo.augmentation import CONDITIONS, Condition
from model_zoo.checkpoints import Checkpoint
from model_zoo.environment import Device, choose_device
from model_zoo.evaluation.blind_references import score_references, with_leads
from model_zoo.evaluation.evaluation import Evaluation, digest_of, summarise_recipe
from model_zoo.evaluation.judged_split import JudgedSplit, open_judged_split
from model_zoo.evaluation.latency import measure_latency
from model_zoo.evaluation.predictions import predict_split
from model_zoo.evaluation.score_cells import score_cells

RESAMPLES, RESAMPLE_SEED = 1000, 0
"""Of recordings, unless the caller asks for others."""


def evaluate(
    checkpoint: Checkpoint,
    dataset: Path,
    split: str = "test",
    conditions: Sequence[Condition] = CONDITIONS,
    *,
    batch_size: int = 32,
    device: Device = "cpu",
    seed: int = RESAMPLE_SEED,
    resamples: int = RESAMPLES,
    every: int = 1,
    progress: Progress | None = None,
    references: Path | None = None,
) -> Evaluation:
    """Predict a split under each condition and score it, scenario by scenario.

    The primary figure is on rows in which no failure is under way at the anchor, and every score
    stands beside those of the blind references, which have no camera and no cloud.

    Args:
        checkpoint: What to evaluate; its model is moved to ``device``.
        dataset: The dataset's folder; a row's scenario is the group of its recording.
        split: Rows to take.
        conditions: What is done to the sensors; see :mod:`model_zoo.augmentation`. The first is
            what tables and plots show where they show one: ``clean``.
        batch_size: Rows at a time.
        device: ``auto`` takes a GPU where there is one.
        seed: Of degradations and resamples.
        resamples: Of recordings, for the intervals.
        every: Take each so many of a recording's judged rows; neighbours are much alike.
        progress: Is told of every batch.
        references: The dataset whose training rows teach the blind references, if ``dataset`` has
            none.

    Raises:
        ZooError: The dataset does not fit the model, the split has no judged step, a condition is
            unknown, there is no such device, a prediction is not finite, the blind references
            cannot be taught, or the split is not apart from what teaches.
        ShardError: The dataset is missing or damaged, or has no such split.
    """
    chosen, teach = choose_device(device), references or dataset
    progress = progress or Silent()
    rows = open_judged_split(checkpoint, dataset, split, conditions, every)
    taught_on = read_index(teach).dataset_digest
    blind = score_references(rows, teach, taught_on, conditions, resamples, seed, progress)
    checkpoint.model.to(chosen)
    latency = measure_latency(checkpoint, _first(rows))
    predicted = predict_split(checkpoint, rows, conditions, batch_size, seed, progress)
    cells = [
        with_leads(cell, blind)
        for place, condition in enumerate(conditions)
        for cell in score_cells(
            rows, predicted[condition], condition, resamples, seed, resampled=place == 0
        )
    ]
    return Evaluation(
        **_describe(checkpoint),
        dataset=rows.dataset.digest,
        split=split,
        resamples=resamples,
        resample_seed=seed,
        every=every,
        references=blind,
        cells=tuple(cells),
        latency=latency,
    )


def with_training(evaluation: Evaluation, checkpoint: Checkpoint) -> Evaluation:
    """An evaluation, with what its checkpoint tells of the training; older ones lack some of it."""
    return evaluation.model_copy(update=_describe(checkpoint))


def _first(split: JudgedSplit) -> dict[str, torch.Tensor]:
    columns = split.dataset.batch(split.rows[:1])
    return {name: torch.from_numpy(array) for name, array in columns.items()}


def _describe(checkpoint: Checkpoint) -> dict[str, Any]:
    recipe = checkpoint.recipe if isinstance(checkpoint.recipe, Mapping) else {}
    seed, searched = recipe.get("seed"), recipe.get("searched")
    steps = checkpoint.metrics.get("steps")
    calibration = checkpoint.calibration
    return {
        "model": checkpoint.config.model,
        "preset": checkpoint.config.preset,
        "seed": seed if isinstance(seed, int) else None,
        "searched": searched if isinstance(searched, int) and searched > 0 else None,
        "recipe": summarise_recipe(_recipe(checkpoint)),
        "ranks": None if checkpoint.config.lineage is None else checkpoint.config.lineage.ranks,
        "steps": steps if isinstance(steps, int) and steps >= 0 else None,
        "parameters": checkpoint.config.parameters,
        "settings": digest_of(checkpoint.config.numbers),
        "checkpoint": checkpoint.digest,
        "trained_on": checkpoint.config.dataset_digest,
        "temperature": None if calibration is None else calibration.temperature,
    }


def _recipe(checkpoint: Checkpoint) -> Any:
    """The recipe, and where a training that extends another began: its steps had another rate."""
    begun = checkpoint.config.begins_from
    if begun is None or not isinstance(checkpoint.recipe, Mapping):
        return checkpoint.recipe
    return {**checkpoint.recipe, "begins_at_step": begun.step}
