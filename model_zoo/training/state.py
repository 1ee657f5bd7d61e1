"""Which training it is, and what it has come to, epoch by epoch."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from pydantic import JsonValue
from torch import Tensor

from graspe_data.manifest import Settings
from model_zoo.checkpoints.config import Beginning
from model_zoo.contract import SuccessModel
from model_zoo.training.meter import LossMeans
from model_zoo.training.recipe import Recipe


class EpochRecord(Settings):
    """One epoch of a training.

    Attributes:
        epoch: Counted from 0.
        step: Steps done at its end.
        means: Mean over its steps of the loss (``loss``), of its parts and of the gradient's
            length.
        au_roc: On the validation rows that select, their judged steps pooled.
        validation_loss: Mean cross-entropy of these steps, nats.
        seconds: Its training and validation took, in the process that finished it.
        samples_per_s: Training rows a second, of all ranks.
        data_wait_share: Share of the training time spent waiting for a batch.
    """

    epoch: int
    step: int
    means: Mapping[str, float]
    au_roc: float
    validation_loss: float
    seconds: float = 0.0
    samples_per_s: float = 0.0
    data_wait_share: float = 0.0


def best_epoch(history: Sequence[EpochRecord]) -> int:
    """The place of the highest validation AU-ROC, the first where some are equal."""
    return max(range(len(history)), key=lambda place: (history[place].au_roc, -place))


def is_exhausted(history: Sequence[EpochRecord], patience: int | None) -> bool:
    """Whether the last ``patience`` epochs were no better than the best before them."""
    if patience is None or not history:
        return False
    return len(history) - 1 - best_epoch(history) >= patience


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
