"""From a model's name, a dataset and a recipe to a checkpoint."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import torch
from pydantic import JsonValue

from graspe_data.errors import ZooError
from model_zoo.checkpoints.sealed_folder import SEAL_NAME
from model_zoo.contract import SuccessModel
from model_zoo.registry import create_model, model_settings
from model_zoo.training.data import open_data
from model_zoo.training.history import best_epoch
from model_zoo.training.machine import Machine, launch_fabric
from model_zoo.training.progress import SilentProgress, TrainingProgress
from model_zoo.training.publish import publish
from model_zoo.training.recipe import Recipe
from model_zoo.training.state import Identity, TrainingState
from model_zoo.training.state_file import StateFile
from model_zoo.training.step_seed import step_seed
from model_zoo.training.trainer import Trainer

CHECKPOINT_FOLDER, STATE_FILE = "checkpoint", "state.safetensors"


def train(
    model_name: str,
    preset: str,
    dataset: Path,
    recipe: Recipe,
    out: Path,
    progress: TrainingProgress | None = None,
    machine: Machine | None = None,
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
    named = (model_name, preset, numbers)
    return train_model(model, *named, dataset, recipe, out, progress, machine)


def train_model(
    model: SuccessModel,
    name: str,
    preset: str,
    numbers: dict[str, JsonValue],
    dataset: Path,
    recipe: Recipe,
    out: Path,
    progress: TrainingProgress | None = None,
    machine: Machine | None = None,
) -> Path:
    """Train any model that keeps the contract; see :func:`train`.

    Args:
        model: With the weights to begin with; left with the best.
        name: For the checkpoint and for texts.
        preset: For the checkpoint.
        numbers: The model's settings, as JSON has them.
        dataset: As in :func:`train`.
        recipe: As in :func:`train`.
        out: As in :func:`train`.
        progress: As in :func:`train`.
        machine: As in :func:`train`.
    """
    machine, progress = machine or Machine(), progress or SilentProgress()
    _make(out)
    fabric = launch_fabric(machine, recipe, out)
    data = open_data(dataset, model, name, recipe, machine, fabric)
    identity = Identity(
        model=name,
        preset=preset,
        numbers=numbers,
        dataset=data.digest,
        recipe=recipe,
        ranks=fabric.world_size,
    )
    file = StateFile(out / STATE_FILE, identity)
    trainer = Trainer(fabric, model, data, recipe, machine, file, progress)
    checkpoint = out / CHECKPOINT_FOLDER
    done = trainer.is_finished and (checkpoint / SEAL_NAME).is_file()
    progress.start(f"{name} {preset}", trainer.steps, trainer.state.step)
    state = trainer.run()
    model.load_state_dict(state.best)
    if not done:
        publish(fabric, model, data, identity, state, checkpoint)
    progress.finish(_summary(state, trainer.steps, checkpoint))
    return checkpoint


def _summary(state: TrainingState, steps: int, checkpoint: Path) -> str:
    best = state.history[best_epoch(state.history)]
    why = "all steps done" if state.step >= steps else "no better for the recipe's patience"
    return (
        f"{why}; best epoch {best.epoch} of {len(state.history)}, validation AU-ROC "
        f"{best.au_roc:.4f}; {checkpoint}"
    )


def _make(out: Path) -> None:
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ZooError(f"{out}: cannot be made: {error.strerror}. Give another folder.") from error
