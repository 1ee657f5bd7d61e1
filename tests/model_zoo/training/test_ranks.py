"""What two ranks publish is the model that they publish, for every model of the zoo."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import torch
from numpy.typing import NDArray

from graspe_data.shards import Dataset
from model_zoo.checkpoints import load_checkpoint
from model_zoo.metrics import au_roc, brier
from model_zoo.registry import MODELS
from tests.model_zoo.training.smallest import write_rows

ROOT = Path(__file__).parents[3]


@pytest.fixture(scope="module")
def trained(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A dataset, and each model's run by two ranks."""
    folder = tmp_path_factory.mktemp("ranks")
    dataset = write_rows(folder / "dataset")
    environment = {**os.environ, "OMP_NUM_THREADS": "1", "GLOO_SOCKET_IFNAME": "lo"}
    torchrun = [sys.executable, "-m", "torch.distributed.run", "--standalone"]
    script = ["--nproc-per-node=2", "-m", "tests.model_zoo.training.smallest"]
    done = subprocess.run(
        [*torchrun, *script, str(dataset), str(folder)],
        cwd=ROOT,
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return folder


def log_odds(run: Path, dataset: Path) -> tuple[NDArray[np.float64], ...]:
    """Of the published weights for all validation rows, in one process; labels and mask."""
    model = load_checkpoint(run / "checkpoint").model
    rows = Dataset(dataset, "validation")
    batch = rows.batch(range(len(rows)))
    with torch.inference_mode():
        found = model.logits({name: torch.from_numpy(batch[name]) for name in model.columns})
    return found.double().numpy(), batch["success"], batch["success_mask"]  # type: ignore[return-value]


@pytest.mark.parametrize("name", MODELS)
def test_published_weights_score_what_was_published(name: str, trained: Path) -> None:
    metrics = json.loads((trained / name / "checkpoint" / "metrics.json").read_text())
    logits, success, mask = log_odds(trained / name, trained / "dataset")
    loss = float(np.mean(np.logaddexp(0, logits) - success * logits))
    assert metrics["loss"] == pytest.approx(loss, rel=1e-5)
    assert metrics["au_roc"] == pytest.approx(au_roc(logits, success, mask), abs=1e-9)
    calibration = load_checkpoint(trained / name / "checkpoint").calibration
    temperature = 1.0 if calibration is None else calibration.temperature
    assert metrics["brier"] == pytest.approx(brier(logits / temperature, success, mask), rel=1e-5)


@pytest.mark.parametrize("name", MODELS)
def test_the_best_epoch_is_the_published_one(name: str, trained: Path) -> None:
    metrics = json.loads((trained / name / "checkpoint" / "metrics.json").read_text())
    best = metrics["history"][metrics["best_epoch"]]
    assert metrics["au_roc"] == best["au_roc"]
    assert metrics["loss"] == pytest.approx(best["validation_loss"], rel=1e-9)
