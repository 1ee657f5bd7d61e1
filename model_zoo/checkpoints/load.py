"""Load a checkpoint, or say why it does not fit."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

import torch
from pydantic import BaseModel
from torch import Tensor

from graspe_data.errors import ManifestError, ZooError
from graspe_data.manifest import read_yaml, validate
from model_zoo.checkpoints.calibration import Calibration
from model_zoo.checkpoints.config import CheckpointConfig
from model_zoo.checkpoints.sealed_folder import check_sealed, read_bounded
from model_zoo.checkpoints.weights import load_weights
from model_zoo.contract import Observation, SuccessModel
from model_zoo.registry import create_model

_FILES = frozenset(
    {
        "model.safetensors",
        "config.json",
        "recipe.yaml",
        "environment.json",
        "metrics.json",
        "calibration.json",
        "card.md",
    }
)
_LARGEST_JSON = 4 << 20

_Model = TypeVar("_Model", bound=BaseModel)


@dataclass(frozen=True)
class Checkpoint:
    """A trained model and what is known of it.

    Attributes:
        folder: Where it was loaded from.
        model: In evaluation mode, on the CPU until it is moved.
        config: Which model it is and what it reads.
        calibration: None where its probabilities are taken as they are.
        recipe: How it was trained.
        metrics: Its scores on validation rows.
        digest: SHA-256 that names the checkpoint.
    """

    folder: Path
    model: SuccessModel
    config: CheckpointConfig
    calibration: Calibration | None
    recipe: Mapping[str, Any]
    metrics: Mapping[str, Any]
    digest: str

    @property
    def device(self) -> torch.device:
        """Where the weights are."""
        return next(self.model.parameters()).device

    @torch.inference_mode()
    def predict(self, observation: Observation) -> Tensor:
        """Calibrated probabilities of success, float32 (B, T), on the device, without gradients."""
        read = {name: observation[name].to(self.device) for name in self.model.columns}
        logits = self.model.logits(read).float()
        if self.calibration is not None:
            logits = logits / self.calibration.temperature
        return torch.sigmoid(logits)


def load_checkpoint(path: Path | str) -> Checkpoint:
    """Load a checkpoint of :func:`write_checkpoint`; nothing pickled is read.

    Raises:
        ZooError: Names the file, and the digest, version, model, preset, setting, or the weight's
            name, shape or dtype that does not fit.
    """
    folder = Path(path)
    digest = check_sealed(folder, _FILES)
    config = _validated(folder / "config.json", CheckpointConfig)
    calibration = _json(folder / "calibration.json")
    try:
        recipe = read_yaml(folder / "recipe.yaml")
    except ManifestError as error:
        raise ZooError(str(error)) from error
    return Checkpoint(
        folder=folder,
        model=_model(folder, config),
        config=config,
        calibration=_validated(folder / "calibration.json", Calibration) if calibration else None,
        recipe=recipe,
        metrics=_json(folder / "metrics.json"),
        digest=digest,
    )


def _model(folder: Path, config: CheckpointConfig) -> SuccessModel:
    """Make the model without memory to compare its weights, then for real."""
    file = folder / "model.safetensors"

    def make() -> SuccessModel:
        try:
            return create_model(config.model, config.preset, **config.numbers)
        except (ZooError, TypeError) as error:
            raise ZooError(f"{folder / 'config.json'}: {error}") from error

    model = load_weights(file, make)
    read = {column.name for column in config.columns}
    if (config.horizon, read) != (model.horizon, set(model.columns)):
        raise ZooError(
            f"{folder / 'config.json'}: {config.model} predicts {model.horizon} steps from "
            f"{', '.join(model.columns)}; the checkpoint says {config.horizon} from "
            f"{', '.join(sorted(read))}. It was made by another version: train it again."
        )
    return model.eval()


def _validated(path: Path, model: type[_Model]) -> _Model:
    try:
        return validate(_json(path), model, str(path))
    except ManifestError as error:
        raise ZooError(str(error)) from error


def _json(path: Path) -> dict[str, Any]:
    try:
        content = json.loads(read_bounded(path, _LARGEST_JSON))
    except (ValueError, RecursionError) as error:
        raise ZooError(f"{path}: not valid JSON: {error}.") from error
    if not isinstance(content, dict):
        raise ZooError(f"{path}: expected a mapping, found {type(content).__name__}.")
    return content
