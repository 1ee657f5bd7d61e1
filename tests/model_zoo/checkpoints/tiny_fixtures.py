from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import torch

import model_zoo.checkpoints.load as loading
from model_zoo.checkpoints import TemperatureScaling, TrainedModel, write_checkpoint
from model_zoo.contract import SuccessModel
from model_zoo.registry import create_model
from tests.model_zoo.checkpoints.tiny_model import COLUMNS, TinyModel


@pytest.fixture(autouse=True)
def tiny_in_registry(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let the registry know the tiny model."""

    def create(name: str, preset: str = "paper", **numbers: Any) -> SuccessModel:
        return TinyModel(**numbers) if name == "tiny" else create_model(name, preset, **numbers)

    monkeypatch.setattr(loading, "create_model", create)


@pytest.fixture
def write_tiny(tmp_path: Path) -> Callable[..., Path]:
    """Write a checkpoint of the tiny model, with some of its arguments changed."""

    def write(folder: str = "checkpoint", *, seed: int = 0, **changed: Any) -> Path:
        torch.manual_seed(seed)
        arguments: dict[str, Any] = {
            "model_name": "tiny",
            "preset": "small",
            "numbers": {"horizon": 3},
            "model": TinyModel(),
            "columns": COLUMNS,
            "recipe": {"epochs": 2, "seed": seed, "optimiser": {"rate": 5e-4}},
            "dataset_digest": "ab" * 32,
            "metrics": {"au_roc": 0.75, "epoch": 1, "steps": 7},
            "calibration": TemperatureScaling(
                temperature=2.0, judged=7, loss_before=0.9, loss_after=0.6
            ),
        }
        return write_checkpoint(tmp_path / folder, TrainedModel(**(arguments | changed)))

    return write
