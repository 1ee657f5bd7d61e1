"""The state of a training, in one file that is whole or not there."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import safetensors.torch
import torch
from safetensors import SafetensorError, safe_open
from torch import Tensor

from graspe_data.atomic_file import write_atomically
from graspe_data.errors import ManifestError, ZooError
from graspe_data.manifest import Settings, validate
from model_zoo.contract import SuccessModel
from model_zoo.training.history import EpochRecord
from model_zoo.training.meter import LossMeans
from model_zoo.training.state import Identity, TrainingState

Weights = dict[str, Tensor]


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
            **_prefixed("model", model.state_dict()),
            **_prefixed("best", state.best),
            **_optimiser_tensors(optimiser),
        }
        content = safetensors.torch.save(tensors, {"counts": counts.model_dump_json()})
        write_atomically(self.path, [content], ZooError)

    def read(self, model: SuccessModel, optimiser: torch.optim.Optimizer) -> TrainingState | None:
        """Fill model and optimiser from the file.

        Returns:
            The state; None where there is no file.

        Raises:
            ZooError: The file is damaged, or of a training with another model, dataset or recipe.
        """
        if not self.path.exists():
            return None
        try:
            with safe_open(self.path, framework="pt") as file:
                counts = self._counts(file.metadata())
                tensors = {name: file.get_tensor(name) for name in file.keys()}  # noqa: SIM118
            model.load_state_dict(_below("model", tensors))
            _fill_optimiser(optimiser, _below("optimiser", tensors))
        except (SafetensorError, OSError, RuntimeError, ValueError, KeyError) as error:
            raise ZooError(f"{self.path}: a damaged state: {error}. {_ANEW}") from error
        means = LossMeans(counts.epoch_steps, counts.epoch_sums)
        best = _below("best", tensors)
        return TrainingState(counts.step, counts.position, list(counts.history), means, best)

    def _counts(self, metadata: Mapping[str, str] | None) -> _Counts:
        try:
            content = json.loads((metadata or {})["counts"])
            counts = validate(content, _Counts, str(self.path))
        except (ManifestError, KeyError, ValueError) as error:
            raise ZooError(f"{self.path}: no state of a training: {error}. {_ANEW}") from error
        then, now = (identity.model_dump() for identity in (counts.identity, self.identity))
        for what in _differences(then, now):
            raise ZooError(f"{self.path}: the training that began here differs: {what}. {_ANEW}")
        return counts


_ANEW = "Go on with what it began with, or give another folder to begin anew."


def _differences(then: Mapping[str, object], now: Mapping[str, object]) -> list[str]:
    found = []
    for key, value in then.items():
        new = now.get(key)
        if isinstance(value, Mapping) and isinstance(new, Mapping):
            found += [f"{key}.{inner}" for inner in _differences(value, new)]
        elif value != new:
            found.append(f"{key} was {value}, is {new}")
    return found + [f"{key} was none, is {now[key]}" for key in now.keys() - then.keys()]


def _prefixed(prefix: str, tensors: Mapping[str, Tensor]) -> Weights:
    """Separate contiguous copies on the CPU: safetensors stores no views."""
    return {
        f"{prefix}.{name}": tensor.detach().cpu().clone().contiguous()
        for name, tensor in tensors.items()
    }


def _below(prefix: str, tensors: Mapping[str, Tensor]) -> Weights:
    head = f"{prefix}."
    return {name.removeprefix(head): t for name, t in tensors.items() if name.startswith(head)}


def _optimiser_tensors(optimiser: torch.optim.Optimizer) -> Weights:
    slots = optimiser.state_dict()["state"]
    flat = {f"{place}.{name}": t for place, slot in slots.items() for name, t in slot.items()}
    return _prefixed("optimiser", flat)


def _fill_optimiser(optimiser: torch.optim.Optimizer, tensors: Weights) -> None:
    slots: dict[int, Weights] = {}
    for key, tensor in tensors.items():
        place, name = key.split(".", 1)
        slots.setdefault(int(place), {})[name] = tensor
    optimiser.load_state_dict(optimiser.state_dict() | {"state": slots})
