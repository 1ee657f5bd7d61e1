"""From a model's name, a dataset and a recipe to a checkpoint."""

from __future__ import annotations

from contextlib import nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import torch
from pydantic import JsonValue
from safetensors.torch import load_file

from graspe_data.errors import ZooError
from graspe_data.folder_lock import hold_folder
from graspe_data.shards.dataset_index import read_index
from model_zoo.checkpoints.config import WEIGHTS_FILE
from model_zoo.contract import SuccessModel
from model_zoo.registry import create_model, model_settings
from model_zoo.training.data import open_data
from model_zoo.training.earlier_training import (
    CHECKPOINT_FOLDER,
    FinishedTraining,
    is_kept,
    open_finished,
)
from model_zoo.training.machine import Machine, Session, count_ranks, launch_fabric
from model_zoo.training.optimisation import step_seed
from model_zoo.training.progress import SilentProgress, TrainingProgress
from model_zoo.training.publish import publish, summarise
from model_zoo.training.recipe import Recipe
from model_zoo.training.state import Identity
from model_zoo.training.state_file import STATE_FILE, StateFile
from model_zoo.training.trainer import Trainer

LOCK_FILE = ".lock"
"""In a run's folder; tells which process trains there."""


@dataclass(frozen=True)
class NamedModel:
    """A model to train, and what its checkpoint says that it is.

    Attributes:
        model: With the weights to begin with; left with the best.
        name: For the checkpoint and for texts.
        preset: For the checkpoint.
        numbers: The model's settings, as JSON has them.
    """

    model: SuccessModel
    name: str
    preset: str
    numbers: dict[str, JsonValue]


@dataclass(frozen=True)
class TrainingPlan:
    """From what to what a training goes.

    Attributes:
        dataset: A dataset's folder with the splits ``train`` and ``validation``.
        recipe: How to train.
        out: The run's folder, made if it is not there.
        begin: The folder of a finished training that this one extends, or None.
    """

    dataset: Path
    recipe: Recipe
    out: Path
    begin: Path | None = None


def train(
    model_name: str,
    preset: str,
    dataset: Path,
    recipe: Recipe,
    out: Path,
    progress: TrainingProgress | None = None,
    machine: Machine | None = None,
    begin: Path | None = None,
    /,
    **overrides: Any,
) -> Path:
    """Train a model of the zoo, or go on where a training in the same folder was interrupted.

    Interrupted at any step and called again with the same arguments, it gives on one CPU the same
    weights to the bit as if it had run through; after its end it gives the checkpoint again.

    Args:
        model_name: One of the registry's.
        preset: Of that model.
        dataset: A dataset's folder with the splits ``train`` and ``validation``.
        recipe: How to train.
        out: The run's folder, made if it is not there: the state, logs, and the checkpoint.
        progress: Is told how it goes.
        machine: What it runs on.
        begin: The folder of a finished training of the same model, dataset and recipe, which this
            one extends: it goes on from its last step, to the epochs that its own recipe names.
            None begins with random weights.
        overrides: Settings of the model that differ from the preset's.

    Returns:
        The folder of the checkpoint: the weights of the best epoch by validation AU-ROC.

    Raises:
        ZooError: Model, dataset, recipe and what lies in ``out`` do not fit together, or the
            training diverged.
        ShardError: The dataset is none, or damaged.
    """
    numbers = model_settings(model_name, preset, **overrides).model_dump(mode="json")
    torch.manual_seed(step_seed(recipe.seed, -1))
    model = create_model(model_name, preset, **overrides)
    plan = TrainingPlan(dataset, recipe, out, begin)
    return train_model(NamedModel(model, model_name, preset, numbers), plan, progress, machine)


def check_run(model_name: str, preset: str, dataset: Path, recipe: Recipe, out: Path) -> None:
    """See whether :func:`train` with these arguments would begin or go on.

    Raises:
        ZooError: What lies in ``out`` is damaged or of another training.
    """
    identity = Identity(
        model=model_name,
        preset=preset,
        numbers=model_settings(model_name, preset).model_dump(mode="json"),
        dataset=read_index(dataset).dataset_digest,
        recipe=recipe,
        ranks=count_ranks(),
    )
    has_state = StateFile(out / STATE_FILE, identity).is_there()
    is_kept(out / CHECKPOINT_FOLDER, identity, has_state=has_state)


def train_model(
    named: NamedModel,
    plan: TrainingPlan,
    progress: TrainingProgress | None = None,
    machine: Machine | None = None,
) -> Path:
    """Train any model that keeps the contract; see :func:`train`.

    Args:
        named: The model.
        plan: From what to what.
        progress: As in :func:`train`.
        machine: As in :func:`train`.
    """
    machine, out = machine or Machine(), plan.out
    _make(out)
    fabric = launch_fabric(machine, plan.recipe, out)
    session = Session(fabric, machine, progress or SilentProgress())
    identity = Identity(
        model=named.name,
        preset=named.preset,
        numbers=named.numbers,
        dataset=read_index(plan.dataset).dataset_digest,
        recipe=plan.recipe,
        ranks=fabric.world_size,
    )
    finished = None if plan.begin is None else open_finished(plan.begin, identity, out)
    if finished is not None:
        identity = identity.model_copy(update={"begins_from": finished.beginning})
    lock = hold_folder(out, "training", ZooError, LOCK_FILE)
    with lock if fabric.is_global_zero else nullcontext():
        return _train(session, named.model, identity, plan, finished)


def _train(
    session: Session,
    model: SuccessModel,
    identity: Identity,
    plan: TrainingPlan,
    finished: FinishedTraining | None,
) -> Path:
    file, checkpoint = StateFile(plan.out / STATE_FILE, identity), plan.out / CHECKPOINT_FOLDER
    title, progress = f"{identity.model} {identity.preset}", session.progress
    if is_kept(checkpoint, identity, has_state=file.is_there()):
        model.load_state_dict(load_file(checkpoint / WEIGHTS_FILE))
        progress.finish(f"{title}: was finished before; {checkpoint}")
        return checkpoint
    data = open_data(plan.dataset, model, identity, session)
    beginning = None if finished is None else finished.state
    trainer = Trainer(session, model, data, identity.recipe, file, beginning)
    extends = "" if beginning is None else f", from {beginning.path.parent}"
    progress.start(title + extends, trainer.steps, trainer.state.step)
    state = trainer.run()
    model.load_state_dict(state.best)
    calibration = publish(session, model, data, identity, state, checkpoint)
    summary = summarise(state, identity.recipe, trainer.steps, calibration)
    progress.finish(f"{summary}; {checkpoint}")
    return checkpoint


def _make(out: Path) -> None:
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ZooError(f"{out}: cannot be made: {error.strerror}. Give another folder.") from error
