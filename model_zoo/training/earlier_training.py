"""What earlier trainings left: a finished checkpoint in the run's folder, a run to extend."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

from graspe_data.errors import ManifestError, ZooError
from graspe_data.manifest import validate
from graspe_data.sealed_folder import SEAL_FILE
from model_zoo.checkpoints.config import Beginning
from model_zoo.checkpoints.load import checkpoint_digest, published_steps, read_description
from model_zoo.training.recipe import Recipe
from model_zoo.training.state import Identity
from model_zoo.training.state_file import STATE_FILE, StateFile, read_identity

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
        config, stored = read_description(folder)
        recipe = validate(stored, Recipe, str(folder / "recipe.yaml"))
    except (ZooError, ManifestError) as error:
        return str(error).rstrip(".")
    then = Identity(
        model=config.model,
        preset=config.preset,
        numbers=config.numbers,
        dataset=config.dataset_digest,
        recipe=recipe,
        ranks=identity.ranks if config.lineage is None else config.lineage.ranks,
        begins_from=config.begins_from,
    )
    return "; ".join(identity.differences(then))


MAY_DIFFER = frozenset({"recipe.epochs", "recipe.most_steps", "recipe.patience", "recipe.searched"})
"""Of an extension from the training that it begins from."""


@dataclass(frozen=True)
class FinishedTraining:
    """What an extension begins from.

    Attributes:
        state: Its state: weights and optimiser of the last step, and the best weights.
        beginning: What names it.
    """

    state: StateFile
    beginning: Beginning


def open_finished(run: Path, identity: Identity, out: Path) -> FinishedTraining:
    """Look whether a run can be extended.

    Args:
        run: Its folder.
        identity: Of the training that shall begin from it.
        out: That one's folder.

    Raises:
        ZooError: The run is not finished, was of another model, dataset or recipe, or is the same
            folder.
    """
    if run.resolve() == out.resolve():
        raise ZooError(f"{out}: cannot begin from itself. Give another folder to --out.")
    file, checkpoint = run / STATE_FILE, run / CHECKPOINT_FOLDER
    begun = read_identity(file)
    step = StateFile(file, begun).step()
    if not is_kept(checkpoint, begun, has_state=True):
        raise ZooError(
            f"{run}: no finished training, so there is no end to begin from. Run its own command "
            "again until it is."
        )
    _check_same(run, identity, begun)
    _check_end(run, step, published_steps(checkpoint))
    beginning = Beginning(checkpoint=checkpoint_digest(checkpoint), step=step)
    return FinishedTraining(StateFile(file, begun), beginning)


def _check_end(run: Path, step: int, published: object) -> None:
    """The state is that of the checkpoint's end."""
    if step != published:
        raise ZooError(
            f"{run}: the state is of step {step}, the checkpoint beside it of a training of "
            f"{published} steps, so they are not of one training. Run its own command again."
        )


def _check_same(run: Path, identity: Identity, begun: Identity) -> None:
    """All but the length of the training, and where either begins."""
    alike = {"recipe": begun.recipe.model_copy(update=_length(identity)), "begins_from": None}
    for what in identity.model_copy(update={"begins_from": None}).differences(
        begun.model_copy(update=alike)
    ):
        raise ZooError(
            f"{run}: the training there differs: {what}. An extension has the model, the dataset "
            f"and the recipe of its beginning, but for {', '.join(sorted(MAY_DIFFER))}."
        )


def _length(identity: Identity) -> dict[str, int | None]:
    names = (name.removeprefix("recipe.") for name in MAY_DIFFER)
    return {name: getattr(identity.recipe, name) for name in names}
