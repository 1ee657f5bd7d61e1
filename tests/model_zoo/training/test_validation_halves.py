"""One half of the validation rows chooses the epoch, the other fits the temperature."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from graspe_data.columns import Column
from graspe_data.errors import ZooError
from graspe_data.shards.dataset_index import DatasetIndex, read_index, write_index
from model_zoo.checkpoints.calibration import TemperatureScaling, fit_temperature
from model_zoo.metrics import au_roc
from model_zoo.training.validation import Predictions
from tests.model_zoo.training.tiny import (
    RECIPE,
    columns,
    make_rows,
    make_splits,
    train_tiny,
    write_dataset,
)

STAMPS = Column(
    name="stamp_ns", dtype="int64", shape=(), unit="ns", frame="", meaning="", stage="test"
)
SECOND = 1_000_000_000


def with_stamps(tmp_path: Path, **rows: int) -> Path:
    splits = make_splits()
    splits |= {split: make_rows(count, 1, len(splits)) for split, count in rows.items()}
    for place, arrays in enumerate(splits.values()):
        count = len(arrays["success"])
        arrays["recording"] = np.full(count, place, np.int32)
        arrays["stamp_ns"] = np.arange(count) * SECOND
    return write_dataset(tmp_path / "data", splits, (*columns(), STAMPS))


def metrics(out: Path) -> dict[str, Any]:
    found: dict[str, Any] = json.loads((out / "checkpoint" / "metrics.json").read_text())
    return found


def test_a_recording_is_cut_in_time_and_the_metrics_say_so(tmp_path: Path) -> None:
    train_tiny(with_stamps(tmp_path, validation=80), tmp_path)
    scores = metrics(tmp_path)
    assert scores["validation"] == "halves of one recording's time"
    # The horizon is 0.9 s, so the last row before the cut is in neither half. No row's first step
    # fails, so none is failing at its anchor.
    assert (scores["rows_selecting"], scores["rows_calibrating"]) == (39, 40)
    calibration = json.loads((tmp_path / "checkpoint" / "calibration.json").read_text())
    assert calibration["judged"] == 40 * 3


def test_few_rows_do_both_and_the_metrics_say_so(tmp_path: Path) -> None:
    train_tiny(write_dataset(tmp_path / "data", make_splits()), tmp_path)
    scores = metrics(tmp_path)
    assert scores["validation"].startswith("all rows, for no half has failures and successes")
    assert scores["rows_selecting"] == scores["rows_calibrating"] == 9


def test_what_selects_is_not_what_calibrates() -> None:
    draw = np.random.default_rng(0)
    logits, success = draw.normal(size=(60, 3)), draw.random((60, 3)) < 0.5
    half = np.arange(60) < 30
    logits[half] += 4.0 * (2 * success[half] - 1)
    found = Predictions(logits, success, np.ones((60, 3), bool), ~half, half)
    assert found.au_roc() == au_roc(logits[30:], success[30:], np.ones((30, 3)))
    fitted = fit_temperature(*found.of(found.calibrating))
    assert isinstance(fitted, TemperatureScaling)
    assert fitted.judged == 90


def test_a_training_reads_no_row_of_the_test_split(tmp_path: Path) -> None:
    dataset = with_stamps(tmp_path, validation=30, test=30)
    shutil.rmtree(dataset / "test")
    train_tiny(dataset, tmp_path)
    assert metrics(tmp_path)["epochs"] == RECIPE.epochs


def test_a_recording_that_teaches_does_not_select(tmp_path: Path) -> None:
    dataset = with_stamps(tmp_path, validation=30)
    index = read_index(dataset)
    same = [e.model_copy(update={"details": {"content": "c" * 64}}) for e in index.recordings]
    write_index(dataset, DatasetIndex.model_validate(index.model_dump() | {"recordings": same}))
    with pytest.raises(ZooError, match=r"validation\.bag .* and train\.bag .* the same content"):
        train_tiny(dataset, tmp_path)


def test_how_many_trainings_chose_the_settings_decides_nothing(tmp_path: Path) -> None:
    dataset = write_dataset(tmp_path / "data", make_splits())
    weights = []
    for searched in (None, 12):
        out = tmp_path / f"{searched}"
        train_tiny(dataset, out, RECIPE.model_copy(update={"searched": searched}))
        weights.append((out / "checkpoint" / "model.safetensors").read_bytes())
    assert weights[0] == weights[1]
    assert "searched: 12" in (tmp_path / "12" / "checkpoint" / "recipe.yaml").read_text()
