"""What lies in a run's folder already: another's, damaged, or held by another process."""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from safetensors import safe_open
from safetensors.torch import load_file, save_file
from torch import Tensor

from graspe_data.errors import ZooError
from graspe_data.sealed_folder import SEAL_FILE
from model_zoo.contract import Loss, Observation
from model_zoo.training.machine import Machine
from model_zoo.training.progress import SilentProgress
from tests.model_zoo.training.tiny import MACHINE, RECIPE, TinyModel, make_model, train_tiny

ROOT = Path(__file__).parents[3]
OTHER = RECIPE.model_copy(update={"learning_rate": 0.02})


@pytest.fixture(scope="module")
def runs(dataset: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two trainings that differ in their recipe."""
    out = tmp_path_factory.mktemp("runs")
    train_tiny(dataset, out / "one")
    train_tiny(dataset, out / "other", OTHER)
    return out


@pytest.fixture
def one(runs: Path, tmp_path: Path) -> Path:
    return shutil.copytree(runs / "one", tmp_path / "one")


def weights(run: Path) -> bytes:
    return (run / "checkpoint/model.safetensors").read_bytes()


def replace_checkpoint(run: Path, by: Path) -> None:
    shutil.rmtree(run / "checkpoint")
    shutil.copytree(by / "checkpoint", run / "checkpoint")


def test_anothers_checkpoint_is_written_anew_from_the_state(
    dataset: Path, runs: Path, one: Path
) -> None:
    replace_checkpoint(one, runs / "other")
    model = make_model()
    train_tiny(dataset, one, model=model)
    assert model.taught == []
    assert weights(one) == weights(runs / "one") != weights(runs / "other")


def test_a_damaged_checkpoint_is_written_anew_from_the_state(
    dataset: Path, runs: Path, one: Path
) -> None:
    (one / "checkpoint/model.safetensors").write_bytes(b"garbage")
    train_tiny(dataset, one)
    assert weights(one) == weights(runs / "one")


def test_a_whole_checkpoint_needs_no_state(dataset: Path, one: Path) -> None:
    (one / "state.safetensors").unlink()
    model = make_model()
    train_tiny(dataset, one, model=model)
    assert model.taught == []
    stored = load_file(one / "checkpoint/model.safetensors")
    assert all(stored[name].equal(value) for name, value in model.state_dict().items())


def test_without_a_state_anothers_checkpoint_is_refused(dataset: Path, one: Path) -> None:
    (one / "state.safetensors").unlink()
    before = weights(one)
    with pytest.raises(ZooError, match=r"recipe\.learning_rate was 0\.01, is 0\.02"):
        train_tiny(dataset, one, OTHER)
    (one / "checkpoint/card.md").write_text("mine")
    with pytest.raises(ZooError, match=r"no state to write it from: .*card\.md: has 4 bytes"):
        train_tiny(dataset, one)
    assert weights(one) == before


def test_a_finished_training_looks_at_no_row_again(dataset: Path, one: Path) -> None:
    class Deaf(SilentProgress):
        def aside(self, what: str, done: int, of: int) -> None:
            raise AssertionError(what, done, of)

    train_tiny(dataset, one, progress=Deaf())


def rewrite(state: Path, change: Callable[[dict[str, Tensor], dict[str, str]], object]) -> None:
    with safe_open(state, framework="pt") as file:
        metadata = dict(file.metadata())
    tensors = load_file(state)
    change(tensors, metadata)
    save_file(tensors, state, metadata)


def test_a_changed_tensor_of_the_state_is_found(dataset: Path, one: Path) -> None:
    (one / "checkpoint" / SEAL_FILE).unlink()
    rewrite(one / "state.safetensors", lambda tensors, _: tensors["best.net.4.bias"].add_(1))
    with pytest.raises(ZooError, match="a damaged state: SHA-256"):
        train_tiny(dataset, one)


def test_a_state_of_a_former_version_has_no_digest_and_is_read(
    dataset: Path, runs: Path, one: Path
) -> None:
    (one / "checkpoint" / SEAL_FILE).unlink()
    rewrite(one / "state.safetensors", lambda _, metadata: metadata.pop("sha256"))
    train_tiny(dataset, one)
    assert weights(one) == weights(runs / "one")


@pytest.mark.parametrize("name", ["checkpoint", "log"])
def test_a_file_where_a_folder_will_be_is_refused_before_training(
    dataset: Path, tmp_path: Path, name: str
) -> None:
    (tmp_path / name).write_text("mine")
    model = make_model()
    machine = MACHINE.model_copy(update={"tensorboard": True})
    with pytest.raises(ZooError, match=f"{name}: found a file"):
        train_tiny(dataset, tmp_path, model=model, machine=machine)
    assert model.taught == []


def test_no_end_of_threads_and_a_warm_up_without_end_are_refused(
    dataset: Path, tmp_path: Path
) -> None:
    with pytest.raises(ZooError, match="threads: 100000000000 asked for, expected at most 1024"):
        train_tiny(dataset, tmp_path, machine=Machine(threads=10**11))
    endless = RECIPE.model_copy(update={"warm_up_steps": 18})
    with pytest.raises(ZooError, match="warm_up_steps is 18, and the whole training has 18 steps"):
        train_tiny(dataset, tmp_path, endless)


def test_a_second_process_in_the_same_folder_is_refused(dataset: Path, tmp_path: Path) -> None:
    command = [sys.executable, "-m", "tests.model_zoo.training.tiny", str(dataset), str(tmp_path)]
    with subprocess.Popen(
        [*command, "--hold", "4"], cwd=ROOT, stdout=subprocess.PIPE, text=True
    ) as process:
        assert process.stdout is not None
        while process.stdout.readline() != "step 4\n":
            assert process.poll() is None
        with pytest.raises(ZooError, match=f"process {process.pid} on .* is training here"):
            train_tiny(dataset, tmp_path)
        process.kill()
    train_tiny(dataset, tmp_path)


class Tapping(TinyModel):
    """Presses Ctrl-C in the middle of its fourth step."""

    def loss(self, observation: Observation, success: Tensor, mask: Tensor, weight: Tensor) -> Loss:
        if len(self.taught) == 3:
            os.kill(os.getpid(), signal.SIGINT)
        return super().loss(observation, success, mask, weight)


@pytest.fixture
def pythons_own_ctrl_c() -> Iterator[None]:
    """As in a terminal: what a shell starts in the background ignores Ctrl-C."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.mark.usefixtures("pythons_own_ctrl_c")
def test_ctrl_c_ends_the_step_saves_it_and_says_so(
    dataset: Path, runs: Path, tmp_path: Path
) -> None:
    reasons: list[str] = []

    class Listening(SilentProgress):
        def finish(self, why: str) -> None:
            reasons.append(why)

    model = Tapping()
    model.load_state_dict(make_model().state_dict())
    seldom = MACHINE.model_copy(update={"state_every_steps": None})
    with pytest.raises(KeyboardInterrupt):
        train_tiny(dataset, tmp_path, model=model, progress=Listening(), machine=seldom)
    assert reasons == [f"stopped at step 4 of 18, saved in {tmp_path / 'state.safetensors'}"]
    rest = make_model()
    train_tiny(dataset, tmp_path, model=rest)
    assert len(rest.taught) == 14
    assert weights(tmp_path) == weights(runs / "one")
    assert json.loads((tmp_path / "checkpoint/metrics.json").read_text())["steps"] == 18
