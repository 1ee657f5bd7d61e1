"""Write a trained model as a checkpoint."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import safetensors.torch
import yaml
from pydantic import JsonValue
from torch import Tensor

from graspe_data.bundle_contract import Assumptions
from graspe_data.columns import Column
from graspe_data.documents import canonical_json
from graspe_data.errors import ManifestError, ZooError
from graspe_data.manifest import validate
from model_zoo.checkpoints.calibration import TemperatureScaling, Uncalibrated
from model_zoo.checkpoints.card import render_card
from model_zoo.checkpoints.config import (
    CHECKPOINT,
    WEIGHTS_FILE,
    Beginning,
    CheckpointConfig,
    input_columns,
)
from model_zoo.checkpoints.lineage import Lineage
from model_zoo.contract import SuccessModel
from model_zoo.environment import describe_environment


@dataclass(frozen=True, kw_only=True)
class TrainedModel:
    """A model, and all that is known of how it was trained.

    Attributes:
        model_name: Its name in the registry.
        preset: The preset it began from.
        numbers: All its settings, resolved, as JSON has them.
        model: With its trained weights.
        columns: The dataset's columns; those that the model reads are kept with their shapes.
        recipe: How it was trained, resolved.
        dataset_digest: Of the dataset it was trained on.
        metrics: Scores on validation rows.
        calibration: Fitted on validation rows, or why not; None gives probabilities as they are.
        assumptions: How the dataset's rows were made, for those who drive by the model.
        begins_from: The training that this one extends, if it does.
        lineage: The recordings and ranks behind the weights.
    """

    model_name: str
    preset: str
    numbers: Mapping[str, Any]
    model: SuccessModel
    columns: Sequence[Column]
    recipe: Mapping[str, JsonValue]
    dataset_digest: str
    metrics: Mapping[str, JsonValue]
    calibration: TemperatureScaling | Uncalibrated | None
    assumptions: Assumptions | None = None
    begins_from: Beginning | None = None
    lineage: Lineage | None = None

    def config(self) -> CheckpointConfig:
        """What ``config.json`` says.

        Raises:
            ZooError: A column is not declared, or a number is none that JSON has.
        """
        content = {
            "model": self.model_name,
            "preset": self.preset,
            "numbers": dict(self.numbers),
            "horizon": self.model.horizon,
            "columns": input_columns(self.model.columns, self.columns, self.model_name),
            "parameters": sum(parameter.numel() for parameter in self.model.parameters()),
            "dataset_digest": self.dataset_digest,
            "assumptions": self.assumptions,
            "begins_from": self.begins_from,
            "lineage": self.lineage,
        }
        try:
            return validate(content, CheckpointConfig, f"checkpoint of {self.model_name}")
        except ManifestError as error:
            raise ZooError(str(error)) from error


def write_checkpoint(folder: Path, trained: TrainedModel) -> Path:
    """Write a checkpoint; its seal, ``manifest.json``, comes last.

    A checkpoint that stood in the folder is replaced; other files in it are left alone. The same
    model in the same environment gives the same bytes.

    Args:
        folder: Where; made if it is not there.
        trained: The model and its training.

    Returns:
        The folder.

    Raises:
        ZooError: A column is not declared, a weight is not finite, a number is none that JSON has,
            or the folder cannot be written.
    """
    config, environment = trained.config(), describe_environment()
    recipe, metrics, calibration = trained.recipe, trained.metrics, trained.calibration
    files = {
        WEIGHTS_FILE: safetensors.torch.save(_weights(trained.model)),
        "config.json": _json(config.model_dump(mode="json")),
        "recipe.yaml": _yaml(recipe),
        "environment.json": _json(environment),
        "metrics.json": _json(metrics),
        "calibration.json": _json({} if calibration is None else calibration.model_dump()),
        "card.md": render_card(config, recipe, environment, metrics, calibration).encode(),
    }
    CHECKPOINT.write(folder, files)
    return folder


def _weights(model: SuccessModel) -> dict[str, Tensor]:
    """The state as separate contiguous tensors on the CPU."""
    state = model.state_dict()
    weights = {name: tensor.detach().cpu().contiguous().clone() for name, tensor in state.items()}
    for name, tensor in weights.items():
        if not tensor.isfinite().all():
            raise ZooError(f"{name}: a weight is not finite, so the training has diverged.")
    return weights


def _json(content: Mapping[str, Any]) -> bytes:
    try:
        return (canonical_json(content) + "\n").encode()
    except (ValueError, TypeError) as error:
        raise ZooError(f"a checkpoint holds JSON: {error}") from error


def _yaml(content: Mapping[str, JsonValue]) -> bytes:
    plain = json.loads(_json(content))
    return yaml.safe_dump(plain, sort_keys=True, allow_unicode=True).encode()
