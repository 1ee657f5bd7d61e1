"""Load a checkpoint, or say why it does not fit."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

import torch
from pydantic import BaseModel
from torch import Tensor

from graspe_data.documents import parse_document, parse_mapping
from graspe_data.errors import ManifestError, ZooError
from graspe_data.manifest import read_yaml
from model_zoo.checkpoints.calibration import TemperatureScaling, Uncalibrated
from model_zoo.checkpoints.config import (
    CHECKPOINT,
    WEIGHTS_FILE,
    CheckpointConfig,
    Columns,
    model_inputs,
)
from model_zoo.checkpoints.weights import check_sizes, load_weights
from model_zoo.contract import SuccessModel
from model_zoo.registry import create_model, list_models

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
        uncalibrated: Why they are, where the checkpoint tells.
        recipe: How it was trained.
        metrics: Its scores on validation rows.
        digest: SHA-256 that names the checkpoint.
    """

    folder: Path
    model: SuccessModel
    config: CheckpointConfig
    calibration: TemperatureScaling | None
    recipe: Mapping[str, Any]
    metrics: Mapping[str, Any]
    digest: str
    uncalibrated: Uncalibrated | None = None

    @property
    def device(self) -> torch.device:
        """Where the weights are."""
        return next(self.model.parameters()).device

    @torch.inference_mode()
    def log_odds(self, observation: Columns) -> Tensor:
        """Calibrated log-odds of success, float64 (B, T), on the device, without gradients.

        They rank what probabilities of float32 no longer tell apart.

        Args:
            observation: As in :meth:`predict`.

        Raises:
            ZooError: As :meth:`predict`.
        """
        return self._cooled(self._logits(observation).double())

    @torch.inference_mode()
    def predict(self, observation: Columns) -> Tensor:
        """Calibrated probabilities of success, float32 (B, T), on the device, without gradients.

        Args:
            observation: The model's columns, (B, ...) each: tensors, or arrays as a dataset's
                ``batch`` gives them; others in it are not read.

        Raises:
            ZooError: A column is missing, or its rows have another shape.
        """
        return torch.sigmoid(self._cooled(self._logits(observation).float()))

    def _logits(self, observation: Columns) -> Tensor:
        return self.model.logits(model_inputs(observation, self.config.columns, self.device))

    def _cooled(self, logits: Tensor) -> Tensor:
        return logits if self.calibration is None else logits / self.calibration.temperature


def read_description(folder: Path) -> tuple[CheckpointConfig, dict[str, Any]]:
    """What a whole checkpoint is and how it was trained, without its model.

    Raises:
        ZooError: Names the file that is missing, damaged or does not validate.
    """
    CHECKPOINT.check(folder)
    return _validated(folder / "config.json", CheckpointConfig), _recipe(folder)


def checkpoint_digest(folder: Path) -> str:
    """SHA-256 that names a whole checkpoint.

    Raises:
        ZooError: As :func:`read_description`.
    """
    return CHECKPOINT.check(folder)


def published_steps(folder: Path) -> object:
    """Steps of the training behind a checkpoint, as its metrics tell; None where they do not."""
    return _json(folder / "metrics.json").get("steps")


def load_checkpoint(path: Path | str) -> Checkpoint:
    """Load a checkpoint of :func:`write_checkpoint`; nothing pickled is read.

    Raises:
        ZooError: Names the file, and the digest, version, model, preset, setting, or the weight's
            name, shape or dtype that does not fit.
    """
    folder = Path(path)
    digest = CHECKPOINT.check(folder)
    config = _validated(folder / "config.json", CheckpointConfig)
    calibration, uncalibrated = _calibration(folder / "calibration.json")
    return Checkpoint(
        folder=folder,
        model=_model(folder, config),
        config=config,
        calibration=calibration,
        recipe=_recipe(folder),
        metrics=_json(folder / "metrics.json"),
        digest=digest,
        uncalibrated=uncalibrated,
    )


def _calibration(path: Path) -> tuple[TemperatureScaling | None, Uncalibrated | None]:
    content = _json(path)
    if not content:
        return None, None
    if content.get("method") == "none":
        return None, _validated(path, Uncalibrated)
    return _validated(path, TemperatureScaling), None


def _recipe(folder: Path) -> dict[str, Any]:
    path = folder / "recipe.yaml"
    try:
        content = read_yaml(path)
    except ManifestError as error:
        raise ZooError(str(error)) from error
    if not isinstance(content, dict):
        raise ZooError(f"{path}: expected a mapping, found {type(content).__name__}.")
    return content


def _model(folder: Path, config: CheckpointConfig) -> SuccessModel:
    """Make the model without memory to compare its weights, then for real.

    Its numbers are all there, so a preset that is not known here is not needed.
    """
    file = folder / WEIGHTS_FILE
    check_sizes(config.numbers, folder / "config.json")
    known = config.preset in list_models().get(config.model, ())
    preset = config.preset if known else "paper"

    def make() -> SuccessModel:
        try:
            return create_model(config.model, preset, **config.numbers)
        except (ZooError, TypeError) as error:
            raise ZooError(f"{folder / 'config.json'}: {error}") from error

    model = load_weights(file, make, config.parameters)
    read = {column.name for column in config.columns}
    if (config.horizon, read) != (model.horizon, set(model.columns)):
        raise ZooError(
            f"{folder / 'config.json'}: {config.model} predicts {model.horizon} steps from "
            f"{', '.join(model.columns)}; the checkpoint says {config.horizon} from "
            f"{', '.join(sorted(read))}. It was made by another version: train it again."
        )
    return model.eval()


def _validated(path: Path, model: type[_Model]) -> _Model:
    content = CHECKPOINT.read_bounded(path, _LARGEST_JSON)
    return parse_document(content, model, path, ZooError, CHECKPOINT.remedy)


def _json(path: Path) -> dict[str, Any]:
    content = CHECKPOINT.read_bounded(path, _LARGEST_JSON)
    return parse_mapping(content, path, ZooError, CHECKPOINT.remedy)
