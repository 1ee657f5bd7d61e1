"""A training that begins where a finished one ended: more epochs, under a name of its own."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from graspe_data.errors import ZooError
from model_zoo.checkpoints.config import Beginning
from model_zoo.checkpoints.load import checkpoint_digest
from model_zoo.training.kept_checkpoint import CHECKPOINT_FOLDER, is_kept
from model_zoo.training.state import Identity
from model_zoo.training.state_file import STATE_FILE, StateFile, read_identity

MAY_DIFFER = frozenset({"recipe.epochs", "recipe.most_steps", "recipe.patience"})
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
    beginning = Beginning(checkpoint=checkpoint_digest(checkpoint), step=step)
    return FinishedTraining(StateFile(file, begun), beginning)


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
