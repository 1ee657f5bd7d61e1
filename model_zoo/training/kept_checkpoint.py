"""The checkpoint that lies in a run's folder already: is it this training's, and whole?"""

from __future__ import annotations

import os
from pathlib import Path

from graspe_data.errors import ManifestError, ZooError
from graspe_data.manifest import validate
from graspe_data.sealed_folder import SEAL_FILE
from model_zoo.checkpoints.load import read_description
from model_zoo.training.recipe import Recipe
from model_zoo.training.state import Identity

CHECKPOINT_FOLDER = "checkpoint"
"""In a run's folder."""


def is_kept(folder: Path, identity: Identity, *, has_state: bool) -> bool:
    """Whether a training need not be done, since its checkpoint is there.

    Args:
        folder: Of the checkpoint.
        identity: Of the training.
        has_state: Whether a state of this training is there to publish the checkpoint from, where
            what lies there is damaged or another's.

    Returns:
        False where there is none, or one that is to be replaced.

    Raises:
        ZooError: What lies there is damaged or another's, and there is no state.
    """
    if not os.path.lexists(folder):
        return False
    if not folder.is_dir():
        raise ZooError(
            f"{folder}: found a file, expected the folder of a checkpoint or nothing. Move it "
            "away, or give another folder for the run."
        )
    if not os.path.lexists(folder / SEAL_FILE):
        return False
    fault = _fault(folder, identity)
    if fault and not has_state:
        raise ZooError(
            f"{folder}: no checkpoint of this training, and no state to write it from: {fault}. "
            "Give another folder for the run, or move that checkpoint away to train anew."
        )
    return not fault


def _fault(folder: Path, identity: Identity) -> str:
    """What is wrong with the checkpoint, or nothing."""
    try:
        config, told = read_description(folder)
        recipe = validate(told, Recipe, str(folder / "recipe.yaml"))
    except (ZooError, ManifestError) as error:
        return str(error).rstrip(".")
    then = Identity(
        model=config.model,
        preset=config.preset,
        numbers=config.numbers,
        dataset=config.dataset_digest,
        recipe=recipe,
        ranks=identity.ranks,
        begins_from=config.begins_from,
    )
    return "; ".join(identity.differences(then))
