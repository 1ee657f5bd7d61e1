"""The loaders of a training, over a dataset that was checked."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from torch.nn.modules.batchnorm import _BatchNorm

from graspe_data.bundle_contract import Assumptions
from graspe_data.columns import Column
from graspe_data.errors import ZooError
from graspe_data.shards import Dataset
from graspe_data.shards.dataset_index import DatasetIndex, read_index
from model_zoo.augmentation.settings import settings_of_dataset
from model_zoo.batches import BatchLoader
from model_zoo.checkpoints.assumptions import read_assumptions
from model_zoo.checkpoints.lineage import Lineage
from model_zoo.contents import check_contents, check_values
from model_zoo.contract import SuccessModel
from model_zoo.labels import LABEL_COLUMNS, Labels, read_labels
from model_zoo.split_leaks import check_apart
from model_zoo.training.candidates import candidate_columns, check_candidates
from model_zoo.training.checks import SPLITS, TRAIN, VALIDATION, check_declared, check_forward
from model_zoo.training.machine import Session
from model_zoo.training.preparation import Preparation, SoundRows
from model_zoo.training.recipe import Recipe
from model_zoo.training.rows import ChosenRows, RowWeights, balance_rows, choose_rows
from model_zoo.training.state import Identity
from model_zoo.training.validation import CALIBRATING, SELECTING
from model_zoo.validation_rows import ValidationRows, read_validation_rows


@dataclass(frozen=True)
class TrainingData:
    """What a training reads.

    Attributes:
        training: Full batches only: the rows that are left over differ from epoch to epoch.
        validation: Padded, so that all ranks have as many batches.
        weights: Of the training rows.
        columns: As the dataset declares them.
        digest: The dataset's.
        assumptions: How its rows were made; None where it does not tell.
        lineage: The recordings and ranks of this training.
        halves: How the validation rows were divided, in words.
    """

    training: BatchLoader
    validation: BatchLoader
    weights: RowWeights
    columns: tuple[Column, ...]
    digest: str
    assumptions: Assumptions | None
    lineage: Lineage
    halves: str


def open_data(
    folder: Path, model: SuccessModel, identity: Identity, session: Session
) -> TrainingData:
    """Check a dataset and open its loaders.

    All that will be read is compared with its digest, and looked through for NaN, by the first
    rank of each machine, since each may have a copy of its own.

    Raises:
        ZooError: The dataset does not fit the model or the recipe, or a recording of the validation
            is among those that teach.
        ShardError: It is no dataset, or damaged.
    """
    recipe, name = identity.recipe, identity.model
    index = read_index(folder)
    check_declared(index, model, name, str(folder))
    check_apart(index.recordings, index.recordings, VALIDATION, folder)
    labels = {split: read_labels(folder, split) for split in SPLITS}
    check_forward(model, Dataset(folder, VALIDATION, model.columns, check="sha256"), name)
    columns = {
        TRAIN: _training_columns(index, folder, model, recipe),
        VALIDATION: (*model.columns, *LABEL_COLUMNS),
    }
    _look_through(folder, columns, model.columns, session)
    rows = {split: Dataset(folder, split, columns[split]) for split in SPLITS}
    divided = read_validation_rows(folder, labels[VALIDATION].success, labels[VALIDATION].mask)
    return TrainingData(
        _training(rows[TRAIN], labels[TRAIN], model, recipe, session),
        _validation(rows[VALIDATION], labels[VALIDATION], divided, recipe, session),
        balance_rows(labels[TRAIN], recipe.balance),
        index.columns,
        index.dataset_digest,
        read_assumptions(index),
        Lineage.of(index, session.fabric.world_size),
        divided.halves.how,
    )


def _look_through(
    folder: Path,
    columns: Mapping[str, tuple[str, ...]],
    inputs: tuple[str, ...],
    session: Session,
) -> None:
    """Compare digests and look for NaN on the first rank of each machine; all wait for it."""
    if session.fabric.local_rank == 0:
        for split in SPLITS:
            check_contents(folder, split, columns[split], session.progress.aside)
            check_values(Dataset(folder, split, inputs), session.progress.aside)
    session.fabric.barrier()


def _preparation(index: DatasetIndex, recipe: Recipe) -> Preparation:
    changes = recipe.augmentation
    augmentation = None if changes is None else settings_of_dataset(index, changes)
    return Preparation(augmentation, recipe.seed, recipe.candidates)


def _training_columns(
    index: DatasetIndex, folder: Path, model: SuccessModel, recipe: Recipe
) -> tuple[str, ...]:
    offered = [column.name for column in index.columns]
    others = candidate_columns(model, recipe.candidates, offered, str(folder))
    if others:
        check_candidates(folder, TRAIN, recipe.candidates, model.horizon)
    prepared = _preparation(index, recipe).columns(model.columns, offered, str(folder))
    return (*prepared, *LABEL_COLUMNS, *others)


def _training(
    dataset: Dataset,
    labels: Labels,
    model: SuccessModel,
    recipe: Recipe,
    session: Session,
) -> BatchLoader:
    fabric = session.fabric
    rows = choose_rows(labels, recipe.balance)
    _check_one_step(len(rows), recipe.batch_size * fabric.world_size, str(dataset.path))
    _check_normalised(model, recipe.batch_size)
    return BatchLoader(
        ChosenRows(dataset, rows),
        recipe.batch_size,
        seed=recipe.seed,
        rank=fabric.global_rank,
        world_size=fabric.world_size,
        tail="drop",
        workers=session.machine.workers,
        transform=_preparation(dataset.index, recipe),
    )


def _validation(
    dataset: Dataset,
    labels: Labels,
    divided: ValidationRows,
    recipe: Recipe,
    session: Session,
) -> BatchLoader:
    marks = {SELECTING: divided.selecting, CALIBRATING: divided.halves.calibrates}
    reliabilities = recipe.augmentation.reliability if recipe.augmentation else "measured"
    return BatchLoader(
        ChosenRows(dataset, choose_rows(labels, "none"), marks),
        recipe.batch_size,
        transform=SoundRows(reliabilities, recipe.seed),
        rank=session.fabric.global_rank,
        world_size=session.fabric.world_size,
        tail="pad",
        workers=session.machine.workers,
    )


def _check_one_step(rows: int, step_size: int, where: str) -> None:
    if rows < step_size:
        raise ZooError(
            f"{where}: {rows} training rows with a judged step do not fill one step of "
            f"{step_size}. Set the recipe's batch_size lower, or take fewer ranks."
        )


def _check_normalised(model: SuccessModel, batch_size: int) -> None:
    if batch_size == 1 and any(isinstance(part, _BatchNorm) for part in model.modules()):
        raise ZooError(
            "recipe: batch_size is 1, expected 2 or more: the model normalises by the rows of a "
            "batch, and a single one has no spread."
        )
