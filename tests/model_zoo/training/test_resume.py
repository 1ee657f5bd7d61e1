from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from safetensors import safe_open
from torch import Tensor

from graspe_data.errors import ZooError
from model_zoo.contract import Loss, Observation
from model_zoo.training.optimisation import step_seed
from model_zoo.training.recipe import Recipe
from tests.model_zoo.training.tiny import (
    MACHINE,
    RECIPE,
    TinyModel,
    make_model,
    make_splits,
    train_tiny,
    write_dataset,
)

ROOT = Path(__file__).parents[3]
SCRIPT = "tests.model_zoo.training.tiny"
AUGMENTED = Recipe.model_validate({**RECIPE.model_dump(), "augmentation": {}, "schedule": "cosine"})


class Interrupted(Exception):  # noqa: N818
    pass


class Breaking(TinyModel):
    """Breaks off at its n-th step, or at its n-th look at validation rows."""

    steps, looks = -1, -1

    def loss(self, observation: Observation, success: Tensor, mask: Tensor, weight: Tensor) -> Loss:
        self.steps -= 1
        if self.steps == 0:
            raise Interrupted
        return super().loss(observation, success, mask, weight)

    def logits(self, observation: Observation) -> Tensor:
        if not self.training:
            self.looks -= 1
            if self.looks == 0:
                raise Interrupted
        return super().logits(observation)


def contents(out: Path) -> tuple[dict[str, bytes], str]:
    """All tensors of the state, and the history with neither times nor rates."""
    with safe_open(out / "state.safetensors", framework="pt") as file:
        tensors = {name: file.get_tensor(name).numpy().tobytes() for name in file.keys()}  # noqa: SIM118
    return tensors, (out / "checkpoint/metrics.json").read_text()


@pytest.fixture(scope="module")
def whole(dataset: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A training that was not interrupted."""
    out = tmp_path_factory.mktemp("whole")
    torch.set_num_threads(1)
    train_tiny(dataset, out, AUGMENTED)
    return out


@settings(max_examples=8, deadline=None, derandomize=True)
@given(breaks=st.lists(st.tuples(st.integers(1, 9), st.booleans()), min_size=1, max_size=3))
def test_interrupted_wherever_it_comes_to_the_same_bits(
    dataset: Path,
    whole: Path,
    tmp_path_factory: pytest.TempPathFactory,
    breaks: list[tuple[int, bool]],
) -> None:
    out = tmp_path_factory.mktemp("broken")
    for number, in_validation in breaks:
        torch.manual_seed(step_seed(0, -1))
        model = Breaking()
        model.steps, model.looks = (-1, number + 1) if in_validation else (number, -1)
        try:
            train_tiny(dataset, out, AUGMENTED, model)
        except Interrupted:
            continue
        break
    train_tiny(dataset, out, AUGMENTED)
    assert contents(out) == contents(whole)


def test_killed_and_run_again_it_comes_to_the_same_bits(dataset: Path, tmp_path: Path) -> None:
    train_tiny(dataset, tmp_path / "whole")
    out = tmp_path / "killed"
    step = int(np.random.default_rng().integers(4, 18))
    command = [sys.executable, "-m", SCRIPT, str(dataset), str(out), "--hold", str(step)]
    with subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        for line in process.stdout:
            if line == f"step {step}\n":
                process.send_signal(signal.SIGKILL)
                break
    assert process.returncode == -signal.SIGKILL
    assert not (out / "checkpoint").exists()
    model = make_model()
    train_tiny(dataset, out, model=model)
    assert 0 < len(model.taught) < 18, f"killed at step {step}"
    assert contents(out) == contents(tmp_path / "whole"), f"killed at step {step}"


def test_two_ranks_see_each_row_once_an_epoch_and_learn_what_one_does(
    dataset: Path, tmp_path: Path
) -> None:
    environment = {**os.environ, "OMP_NUM_THREADS": "1", "GLOO_SOCKET_IFNAME": "lo"}
    torchrun = [sys.executable, "-m", "torch.distributed.run", "--standalone"]
    command = [
        *torchrun,
        "--nproc-per-node=2",
        "-m",
        SCRIPT,
        str(dataset),
        str(tmp_path),
        "--plain",
    ]
    done = subprocess.run(
        command, cwd=ROOT, env=environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    ranks = [
        [line.split() for line in (tmp_path / f"taught_{rank}.txt").read_text().splitlines()]
        for rank in (0, 1)
    ]
    for epoch in range(3):
        rows = [
            row for taught in ranks for batch in taught[epoch * 6 : epoch * 6 + 6] for row in batch
        ]
        assert len(rows) == len(set(rows)) == 24
    first, second = (np.load(tmp_path / f"weights_{rank}.npy") for rank in (0, 1))
    assert np.array_equal(first, second)
    recipe = RECIPE.model_copy(update={"balance": "none"})
    alone = train_tiny(dataset, tmp_path / "one", recipe, make_model(dropout=0.0, norm=False))
    weights = torch.cat([value.flatten() for value in alone.state_dict().values()])
    assert np.allclose(first, weights.numpy(), atol=1e-5)
    with pytest.raises(ZooError, match=r"ranks was 2, is 1"):
        train_tiny(
            dataset,
            tmp_path,
            recipe.model_copy(update={"batch_size": 2}),
            make_model(dropout=0.0, norm=False),
        )


def test_another_recipe_or_dataset_is_refused(dataset: Path, tmp_path: Path) -> None:
    train_tiny(dataset, tmp_path)
    other = RECIPE.model_copy(update={"learning_rate": 0.5})
    with pytest.raises(ZooError, match=r"recipe\.learning_rate was 0\.01, is 0\.5\. Go on with"):
        train_tiny(dataset, tmp_path, other)
    splits = make_splits()
    splits["train"]["point_count"] = np.full(24, 2, np.int32)
    moved = write_dataset(tmp_path / "other", splits)
    with pytest.raises(ZooError, match="dataset was"):
        train_tiny(moved, tmp_path)


def test_a_damaged_state_is_refused(dataset: Path, tmp_path: Path) -> None:
    train_tiny(dataset, tmp_path)
    file = tmp_path / "state.safetensors"
    content = file.read_bytes()
    for damaged in (b"", content[:100], content[:-8], content.replace(b"graspe-tr", b"graspe-xx")):
        file.write_bytes(damaged)
        with pytest.raises(ZooError, match="another folder to begin anew"):
            train_tiny(dataset, tmp_path)


def test_how_often_it_is_saved_and_where_it_runs_may_change(dataset: Path, tmp_path: Path) -> None:
    model = Breaking()
    model.steps = 8
    with pytest.raises(Interrupted):
        train_tiny(dataset, tmp_path, model=model)
    resumed = make_model()
    machine = MACHINE.model_copy(update={"workers": 1, "state_every_steps": None})
    train_tiny(dataset, tmp_path, model=resumed, machine=machine)
    assert len(resumed.taught) == 12
