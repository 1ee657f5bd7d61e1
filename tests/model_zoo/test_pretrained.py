"""The trained models that ship in ``pretrained/``."""

from __future__ import annotations

from pathlib import Path

import pytest
import torch

from model_zoo.checkpoints import load_checkpoint

PRETRAINED = Path(__file__).parents[2] / "pretrained"
NAMES = ("graspe", "graspe_no_agnn", "graspe_no_reliability", "nmfnet", "paad")


def test_these_ship_and_nothing_else() -> None:
    assert sorted(path.name for path in PRETRAINED.iterdir()) == [f"{n}-small" for n in NAMES]


@pytest.mark.parametrize("name", NAMES)
def test_a_shipped_checkpoint_is_whole_and_of_one_budget(name: str) -> None:
    checkpoint = load_checkpoint(PRETRAINED / f"{name}-small")
    assert (checkpoint.config.model, checkpoint.config.preset) == (name, "small")
    reference = load_checkpoint(PRETRAINED / "graspe-small")
    assert checkpoint.recipe == reference.recipe
    assert checkpoint.config.dataset_digest == reference.config.dataset_digest
    assert checkpoint.config.assumptions is not None
    assert checkpoint.calibration is not None


@pytest.mark.parametrize("name", NAMES)
def test_a_shipped_model_answers(name: str) -> None:
    checkpoint = load_checkpoint(PRETRAINED / f"{name}-small")
    observation = {
        column.name: torch.zeros(1, *column.shape, dtype=getattr(torch, column.dtype))
        for column in checkpoint.config.columns
    }
    success = checkpoint.predict(observation)
    assert success.shape == (1, checkpoint.config.horizon)
    assert ((success > 0) & (success < 1)).all()
