"""The state of a training, in one file that is whole or not there."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import safetensors.torch
import torch
from safetensors import SafetensorError, safe_open
from torch import Tensor

from graspe_data.atomic_file import write_atomically
from graspe_data.documents import parse_document
from graspe_data.errors import ZooError
from graspe_data.manifest import Settings
from model_zoo.contract import SuccessModel
from model_zoo.training.meter import LossMeans
from model_zoo.training.state import EpochRecord, Identity, TrainingState

STATE_FILE = "state.safetensors"
"""In a run's folder."""


class _Counts(Settings):
    format: Literal["graspe-training-1"] = "graspe-training-1"
    identity: Identity
    step: int
    position: int
    history: tuple[EpochRecord, ...]
    epoch_steps: int
    epoch_sums: Mapping[str, float]


@dataclass(frozen=True)
class StateFile:
    """A safetensors file: tensors of weights, optimiser and best weights; counts as its metadata.

    Attributes:
        path: The file.
        identity: Of the training that it belongs to.
    """

    path: Path
    identity: Identity

    def write(
        self, state: TrainingState, model: SuccessModel, optimiser: torch.optim.Optimizer
    ) -> None:
        """Replace the file; killed on the way, the former one stays.

        Raises:
            ZooError: A loss is not finite, or the file cannot be written.
        """
        counts = _Counts(
            identity=self.identity,
            step=state.step,
            position=state.position,
            history=tuple(state.history),
            epoch_steps=state.means.steps,
            epoch_sums=state.means.sums(),
        )
        tensors = {
            **prefixed("model", model.state_dict()),
            **prefixed("best", state.best),
            **optimiser_tensors(optimiser),
        }
        counted = counts.model_dump_json()
        described = {"counts": counted, "sha256": state_digest(counted, tensors)}
        content = safetensors.torch.save(tensors, described)
        write_atomically(self.path, [content], ZooError)

    def read(self, model: SuccessModel, optimiser: torch.optim.Optimizer) -> TrainingState | None:
        """Fill model and optimiser from the file.

        Returns:
            The state; None where there is no file.

        Raises:
            ZooError: The file is damaged, or of a training with another model, dataset or recipe.
        """
        if not self.is_there():
            return None
        try:
            with safe_open(self.path, framework="pt") as file:
                metadata = file.metadata() or {}
                tensors = {name: file.get_tensor(name) for name in file.keys()}  # noqa: SIM118
            counts = self._counts(metadata)
            self._check_digest(metadata, tensors)
            model.load_state_dict(below("model", tensors))
            fill_optimiser(optimiser, below("optimiser", tensors))
        except (SafetensorError, OSError, RuntimeError, ValueError, KeyError) as error:
            raise ZooError(f"{self.path}: a damaged state: {error}. {_ANEW}") from error
        means = LossMeans(counts.epoch_steps, counts.epoch_sums)
        best = below("best", tensors)
        return TrainingState(counts.step, counts.position, list(counts.history), means, best)

    def is_there(self) -> bool:
        """Whether there is a state, without its tensors.

        Raises:
            ZooError: There is, but damaged, or of another training.
        """
        if not os.path.lexists(self.path):
            return False
        if not self.path.is_file():
            raise ZooError(f"{self.path}: expected a file, found something else. {_ANEW}")
        self._counts(_metadata(self.path))
        return True

    def step(self) -> int:
        """Steps done, without its tensors.

        Raises:
            ZooError: As :meth:`is_there`.
        """
        return self._counts(_metadata(self.path)).step

    def _check_digest(self, metadata: Mapping[str, str], tensors: Weights) -> None:
        """States of former versions have no digest."""
        expected = metadata.get("sha256")
        if expected is None:
            return
        found = state_digest(metadata["counts"], tensors)
        if found != expected:
            raise ZooError(
                f"{self.path}: a damaged state: SHA-256 {found}, expected {expected}. {_ANEW}"
            )

    def _counts(self, metadata: Mapping[str, str]) -> _Counts:
        counts = _parsed(self.path, metadata)
        for what in self.identity.differences(counts.identity):
            raise ZooError(f"{self.path}: the training that began here differs: {what}. {_ANEW}")
        return counts


def read_identity(path: Path) -> Identity:
    """Of the training whose state lies in a file.

    Raises:
        ZooError: There is none, or it is damaged.
    """
    if not path.is_file():
        raise ZooError(
            f"{path}: missing, so {path.parent} is no run that can be extended. Give the folder of "
            "a run as `graspe zoo train` leaves it."
        )
    return _parsed(path, _metadata(path)).identity


def _metadata(path: Path) -> Mapping[str, str]:
    try:
        with safe_open(path, framework="pt") as file:
            return file.metadata() or {}
    except (SafetensorError, OSError) as error:
        raise ZooError(f"{path}: a damaged state: {error}. {_ANEW}") from error


def _parsed(path: Path, metadata: Mapping[str, str]) -> _Counts:
    if "counts" not in metadata:
        raise ZooError(f"{path}: no state of a training. {_ANEW}")
    return parse_document(metadata["counts"].encode(), _Counts, path, ZooError, _ANEW)


_ANEW = "Go on with what it began with, or give another folder to begin anew."


Weights = dict[str, Tensor]


def state_digest(counts: str, tensors: Mapping[str, Tensor]) -> str:
    """SHA-256 of the counts and of each tensor's name, dtype, shape and bytes."""
    digest = hashlib.sha256(counts.encode())
    for name, tensor in sorted(tensors.items()):
        digest.update(f"\0{name}\0{tensor.dtype}\0{tuple(tensor.shape)}\0".encode())
        digest.update(tensor.contiguous().reshape(-1).view(torch.uint8).numpy().data)
    return digest.hexdigest()


def prefixed(prefix: str, tensors: Mapping[str, Tensor]) -> Weights:
    """Separate contiguous copies on the CPU: safetensors stores no views."""
    return {
        f"{prefix}.{name}": tensor.detach().cpu().clone().contiguous()
        for name, tensor in tensors.items()
    }


def below(prefix: str, tensors: Mapping[str, Tensor]) -> Weights:
    """The tensors under a prefix, without it."""
    head = f"{prefix}."
    return {name.removeprefix(head): t for name, t in tensors.items() if name.startswith(head)}


def optimiser_tensors(optimiser: torch.optim.Optimizer) -> Weights:
    """What an optimiser remembers of each weight."""
    slots = optimiser.state_dict()["state"]
    flat = {f"{place}.{name}": t for place, slot in slots.items() for name, t in slot.items()}
    return prefixed("optimiser", flat)


def fill_optimiser(optimiser: torch.optim.Optimizer, tensors: Weights) -> None:
    """Give an optimiser back what :func:`optimiser_tensors` took."""
    slots: dict[int, Weights] = {}
    for key, tensor in tensors.items():
        place, name = key.split(".", 1)
        slots.setdefault(int(place), {})[name] = tensor
    optimiser.load_state_dict(optimiser.state_dict() | {"state": slots})
