from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from graspe_data.manifest import load_manifest
from model_zoo.checkpoints import load_checkpoint
from model_zoo.evaluation import compare, evaluate
from model_zoo.evaluation.zoo_index import ZooIndex, shipped_index
from model_zoo.registry import list_models
from tests.model_zoo.checkpoints.tiny_model import write_tiny_dataset


def test_every_training_is_listed_with_its_digest_and_scores(
    write_tiny: Callable[..., Path], tmp_path: Path
) -> None:
    data = write_tiny_dataset(tmp_path / "data", ("hill", "hill", "hill"))
    folders = [write_tiny(f"tiny-{seed}", seed=seed) for seed in (0, 1)]
    made = [evaluate(load_checkpoint(f), data, conditions=("clean", "dark")) for f in folders]
    index = load_manifest(compare(made, tmp_path / "out").with_name("zoo.yaml"), ZooIndex)
    assert [entry.checkpoint for entry in index.trainings] == [e.checkpoint for e in made]
    assert [entry.seed for entry in index.trainings] == [0, 1]
    cells = [evaluation.cell("hill", "clean") for evaluation in made]
    values = [cell.scores["au_roc"].value for cell in cells if cell]
    for entry, value in zip(index.trainings, values, strict=True):
        assert entry.au_roc["hill"] == pytest.approx(value, abs=1e-4)
        assert set(entry.au_roc_by_condition) == {"clean", "dark"}
    mean = sum(value for value in values if value is not None) / 2
    assert index.mean_au_roc("tiny", "small") == pytest.approx(mean, abs=1e-3)
    assert index.mean_au_roc("tiny", "paper") is None


def test_the_index_that_ships_names_models_and_presets_that_there_are() -> None:
    known = list_models()
    for entry in shipped_index().trainings:
        assert entry.preset in known[entry.model]
