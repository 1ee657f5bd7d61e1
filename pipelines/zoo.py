"""Train, evaluate and compare models of the zoo under one budget, going on where it stopped."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Protocol

from graspe_data.errors import ZooError
from graspe_data.progress import Progress
from graspe_data.shards import Dataset
from model_zoo.augmentation import CONDITIONS, Condition
from model_zoo.checkpoints import load_checkpoint
from model_zoo.evaluation.compare import compare
from model_zoo.evaluation.evaluate import RESAMPLE_SEED, RESAMPLES, evaluate, with_training
from model_zoo.evaluation.evaluation import Evaluation, evaluation_name, read_evaluation
from model_zoo.training.machine import Machine
from model_zoo.training.progress import TrainingProgress
from model_zoo.training.recipe import Recipe
from model_zoo.training.train import check_run, train
from pipelines.zoo_checks import check_data, check_distinct, check_folders

COMPARISON_FOLDER = "comparison"


class ZooProgress(Protocol):
    """Gives someone to tell about each training and each evaluation."""

    def training(self) -> AbstractContextManager[TrainingProgress]:
        """For one training."""

    def evaluation(self) -> AbstractContextManager[Progress]:
        """For one evaluation."""


@dataclass(frozen=True)
class ZooRun:
    """One training: a model in a preset, under a seed of the common recipe."""

    model: str
    preset: str
    seed: int

    @property
    def name(self) -> str:
        """The run's folder."""
        return f"{self.model}-{self.preset}-{self.seed}"


@dataclass(frozen=True)
class Zoo:
    """What all runs have in common.

    Attributes:
        dataset: The dataset's folder.
        recipe: The budget; its seed is each run's own.
        out: The folder of all runs.
        split: What is evaluated.
        conditions: What is done to the sensors in evaluation.
        every: Of the judged rows of a recording, every so many are evaluated.
        machine: What it runs on.
    """

    dataset: Path
    recipe: Recipe
    out: Path
    split: str = "test"
    conditions: Sequence[Condition] = CONDITIONS
    every: int = 1
    machine: Machine = field(default_factory=Machine)

    def recipe_of(self, run: ZooRun) -> Recipe:
        """The common recipe under the run's seed."""
        return self.recipe.model_copy(update={"seed": run.seed})


def plan_runs(models: Sequence[str], preset: str, seeds: int) -> list[ZooRun]:
    """Every model under the seeds 0 to ``seeds`` - 1; all models of a seed before the next."""
    return [ZooRun(model, preset, seed) for seed in range(seeds) for model in models]


def run_zoo(zoo: Zoo, runs: Sequence[ZooRun], progress: ZooProgress) -> Path:
    """Train and evaluate every run, and compare them.

    What is finished is not done again; what was interrupted goes on.

    Returns:
        The comparison, a Markdown file.

    Raises:
        ZooError: A model, recipe, dataset or what lies in the folder do not fit together.
    """
    check_distinct([run.name for run in runs], zoo.conditions)
    check_data(zoo.dataset, zoo.split, [(run.model, run.preset) for run in runs])
    check_folders(zoo.out, [*(run.name for run in runs), COMPARISON_FOLDER])
    for run in runs:
        check_run(run.model, run.preset, zoo.dataset, zoo.recipe_of(run), zoo.out / run.name)
    evaluations = list(_evaluations(zoo, runs, progress))
    return compare(evaluations, zoo.out / COMPARISON_FOLDER)


def _evaluations(zoo: Zoo, runs: Sequence[ZooRun], progress: ZooProgress) -> Iterator[Evaluation]:
    named_file = evaluation_name(zoo.split, zoo.conditions, zoo.every)
    for run in runs:
        recipe = zoo.recipe_of(run)
        folder, named = zoo.out / run.name, (run.model, run.preset)
        with progress.training() as of_training:
            checkpoint = train(*named, zoo.dataset, recipe, folder, of_training, zoo.machine)
        with progress.evaluation() as of_evaluation:
            yield evaluate_once(zoo, checkpoint, folder / named_file, of_evaluation)


def evaluate_once(zoo: Zoo, checkpoint: Path, file: Path, progress: Progress) -> Evaluation:
    """The evaluation of a checkpoint: the one in the file where that is of it, else a new one."""
    model = load_checkpoint(checkpoint)
    earlier = _earlier_evaluation(file)
    digest = Dataset(zoo.dataset, zoo.split, ()).digest
    wanted = (
        model.digest,
        digest,
        zoo.split,
        tuple(zoo.conditions),
        zoo.every,
        RESAMPLES,
        RESAMPLE_SEED,
    )
    if earlier is not None:
        is_current = (
            earlier.checkpoint,
            earlier.dataset,
            earlier.split,
            earlier.conditions,
            earlier.every,
            earlier.resamples,
            earlier.resample_seed,
        )
        if is_current == wanted:
            return with_training(earlier, model)
    evaluation = evaluate(
        model,
        zoo.dataset,
        zoo.split,
        zoo.conditions,
        device=zoo.machine.device,
        every=zoo.every,
        progress=progress,
    )
    evaluation.write(file)
    return evaluation


def _earlier_evaluation(file: Path) -> Evaluation | None:
    try:
        return read_evaluation(file) if file.is_file() else None
    except ZooError:
        return None
