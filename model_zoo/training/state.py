"""Which training it is, and what it has come to."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from pydantic import JsonValue
from torch import Tensor

from graspe_data.manifest import Settings
from model_zoo.checkpoints.config import Beginning
from model_zoo.contract import SuccessModel
from model_zoo.training.history import EpochRecord
from model_zoo.training.meter import LossMeans
from model_zoo.training.recipe import Recipe


class Identity(Settings):
    """What must be the same for a training to go on.

    Attributes:
        model: Its name.
        preset: The preset it began from.
        numbers: Its settings, resolved.
        dataset: The digest.
        recipe: How it is trained.
        ranks: Processes that share a step.
        begins_from: The training that it extends; None where it begins with random weights.
    """

    model: str
    preset: str
    numbers: Mapping[str, JsonValue]
    dataset: str
    recipe: Recipe
    ranks: int = 1
    begins_from: Beginning | None = None

    def differences(self, then: Identity) -> list[str]:
        """What another training has otherwise, as sentences without their end."""
        return _differences(then.model_dump(mode="json"), self.model_dump(mode="json"))


@dataclass
class TrainingState:
    """What a training has come to.

    Attributes:
        step: Steps done.
        position: Of the loader: samples consumed by all ranks.
        history: The epochs that were validated.
        means: The losses of the epoch under way.
        best: The weights of the best epoch so far, on the CPU; empty before the first.
    """

    step: int = 0
    position: int = 0
    history: list[EpochRecord] = field(default_factory=list)
    means: LossMeans = field(default_factory=LossMeans)
    best: dict[str, Tensor] = field(default_factory=dict)

    def keep_best(self, model: SuccessModel) -> None:
        """Keep the model's weights as the best."""
        weights = model.state_dict()
        self.best = {name: tensor.detach().cpu().clone() for name, tensor in weights.items()}


def _differences(then: Mapping[str, object], now: Mapping[str, object]) -> list[str]:
    found = []
    for key, value in then.items():
        new = now.get(key)
        if isinstance(value, Mapping) and isinstance(new, Mapping):
            found += [f"{key}.{inner}" for inner in _differences(value, new)]
        elif value != new:
            found.append(f"{key} was {value}, is {new}")
    return found + [f"{key} was none, is {now[key]}" for key in now.keys() - then.keys()]
