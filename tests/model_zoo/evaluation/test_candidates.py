"""Where rows have candidates, an evaluation asks about them too."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import model_zoo.checkpoints.load as loading
from graspe_data.shards import Dataset
from model_zoo.checkpoints import load_checkpoint
from model_zoo.evaluation import compare, evaluate
from model_zoo.evaluation.scenes import scene_areas
from tests.model_zoo.checkpoints.tiny_model import (
    WITH_CANDIDATES,
    DrawnModel,
    write_tiny_dataset,
)


@pytest.fixture
def dataset(tmp_path: Path) -> Path:
    return write_tiny_dataset(
        tmp_path / "data", ("hill", "hill", "hill", "lake"), columns=WITH_CANDIDATES
    )


def test_a_model_that_reads_trajectories_is_scored_within_a_scene(
    write_tiny: Callable[..., Path], dataset: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    def create(name: str, preset: str = "paper", **numbers: Any) -> DrawnModel:
        return DrawnModel(**numbers)

    monkeypatch.setattr(loading, "create_model", create)
    folder = write_tiny(model=DrawnModel(), columns=WITH_CANDIDATES)
    found = evaluate(load_checkpoint(folder), dataset, conditions=("clean", "dark"), resamples=30)
    cell = found.cell()
    assert cell is not None
    part = cell.parts["within_a_scene"]
    dark = found.cell("all", "dark")
    assert dark is not None
    assert "within_a_scene" not in dark.parts
    # It ranks by the covered share, which the candidates' speeds tell: so does a blind reference.
    rows: dict[str, Any] = dict(Dataset(dataset, "test").batch(range(48)))
    sound = rows["success_mask"].any(axis=1) & (rows["state"] != 0)
    through = rows["candidate_success"].astype(bool).all(axis=2)
    covered = rows["candidate_image"].reshape(48, 4, -1).mean(axis=2)
    expected = scene_areas(-covered, through, rows["candidate_mask"])[sound]
    assert part.rows == np.isfinite(expected).sum()
    assert part.au_roc.value == pytest.approx(np.nanmean(expected))
    assert part.au_roc.low is not None
    assert part.lead is not None
    assert part.lead.reference in ("speed", "velocity", "velocity_history")
    assert abs(part.lead.value or 1.0) < 0.1
    constant = found.references.scores[0].cell()
    assert constant is not None
    assert constant.parts["within_a_scene"].au_roc.value == 0.5
    assert "within a scene" in compare([found], tmp_path / "out").read_text()


def test_a_model_that_reads_none_has_no_such_score(
    write_tiny: Callable[..., Path], dataset: Path
) -> None:
    found = evaluate(load_checkpoint(write_tiny()), dataset, conditions=("clean",), resamples=9)
    cell = found.cell()
    assert cell is not None
    assert "within_a_scene" not in cell.parts
