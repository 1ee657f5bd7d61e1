"""A finished training goes on to more epochs, as a run that says where it began."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest
import torch
from safetensors.torch import load_file

from graspe_data.errors import ZooError
from model_zoo.checkpoints.load import checkpoint_digest, read_description
from model_zoo.registry import MODELS
from model_zoo.training.recipe import Recipe
from model_zoo.training.train import train
from tests.model_zoo.training.smallest import RECIPE as SMALLEST_RECIPE
from tests.model_zoo.training.smallest import SMALLEST, write_rows
from tests.model_zoo.training.test_train import Told, changed
from tests.model_zoo.training.tiny import (
    MACHINE,
    RECIPE,
    make_model,
    make_splits,
    train_tiny,
    write_dataset,
)

LONGER = changed(epochs=5)


class Saying(Told):
    def start(self, what: str, steps: int, done: int) -> None:
        self.what, self.began = what, (steps, done)


@pytest.fixture(scope="module")
def finished(dataset: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("finished")
    train_tiny(dataset, out)
    return out


def weights(run: Path) -> dict[str, torch.Tensor]:
    return load_file(run / "state.safetensors")


def same(one: Path, other: Path) -> bool:
    pairs = weights(one), weights(other)
    return all(torch.equal(tensor, pairs[1][name]) for name, tensor in pairs[0].items())


def test_at_a_constant_rate_it_comes_to_the_bits_of_a_training_that_long(
    dataset: Path, finished: Path, tmp_path: Path
) -> None:
    progress = Saying()
    model = make_model()
    train_tiny(dataset, tmp_path / "on", LONGER, model, progress, begin=finished)
    assert progress.what == f"tiny small, from {finished}"
    assert progress.began == (30, 18)
    assert len(model.taught) == 12
    train_tiny(dataset, tmp_path / "whole", LONGER)
    assert same(tmp_path / "on", tmp_path / "whole")
    on, whole = (
        json.loads((tmp_path / run / "checkpoint/metrics.json").read_text())
        for run in ("on", "whole")
    )
    assert on == whole


def test_it_is_named_so_and_the_run_it_begins_from_stays(
    dataset: Path, finished: Path, tmp_path: Path
) -> None:
    before = {path: path.read_bytes() for path in finished.rglob("*") if path.is_file()}
    train_tiny(dataset, tmp_path, LONGER, begin=finished)
    config, recipe = read_description(tmp_path / "checkpoint")
    assert config.begins_from is not None
    assert config.begins_from.checkpoint == checkpoint_digest(finished / "checkpoint")
    assert config.begins_from.step == 18
    assert recipe["epochs"] == 5
    card = (tmp_path / "checkpoint/card.md").read_text()
    assert f"checkpoint `{config.begins_from.checkpoint}`, after 18 steps" in card
    assert {path: path.read_bytes() for path in before} == before
    plain, _ = read_description(finished / "checkpoint")
    assert plain.begins_from is None


def test_run_again_it_is_not_done_again_and_another_beginning_is_refused(
    dataset: Path, finished: Path, tmp_path: Path
) -> None:
    train_tiny(dataset, tmp_path, LONGER, begin=finished)
    model = make_model()
    train_tiny(dataset, tmp_path, LONGER, model, begin=finished)
    assert model.taught == []
    with pytest.raises(ZooError, match="begins_from was "):
        train_tiny(dataset, tmp_path, LONGER)


def test_an_extension_can_be_extended(dataset: Path, finished: Path, tmp_path: Path) -> None:
    train_tiny(dataset, tmp_path / "on", LONGER, begin=finished)
    train_tiny(dataset, tmp_path / "further", changed(epochs=6), begin=tmp_path / "on")
    train_tiny(dataset, tmp_path / "whole", changed(epochs=6))
    assert same(tmp_path / "further", tmp_path / "whole")


def test_interrupted_it_goes_on_in_its_own_folder(
    dataset: Path, finished: Path, tmp_path: Path
) -> None:
    broken = make_model()
    loss = broken.loss

    def failing(*batch: object) -> object:
        if len(broken.taught) == 8:
            raise RuntimeError("broken off")
        return loss(*batch)  # type: ignore[arg-type]

    broken.loss = failing  # type: ignore[assignment]
    with pytest.raises(RuntimeError, match="broken off"):
        train_tiny(dataset, tmp_path / "on", LONGER, broken, begin=finished)
    resumed = make_model()
    train_tiny(dataset, tmp_path / "on", LONGER, resumed, begin=finished)
    assert 0 < len(resumed.taught) < 12
    train_tiny(dataset, tmp_path / "whole", LONGER)
    assert same(tmp_path / "on", tmp_path / "whole")


@pytest.mark.parametrize(
    ("recipe", "message"),
    [
        (RECIPE, "are all that this recipe asks for"),
        (changed(epochs=2), "are all that this recipe asks for"),
        (changed(epochs=5, learning_rate=0.5), r"recipe\.learning_rate was 0\.01, is 0\.5"),
        (changed(epochs=5, seed=1), r"recipe\.seed was 0, is 1"),
        (changed(epochs=5, batch_size=2), r"recipe\.batch_size was 4, is 2"),
    ],
)
def test_what_is_no_extension_is_refused(
    dataset: Path, finished: Path, tmp_path: Path, recipe: Recipe, message: str
) -> None:
    with pytest.raises(ZooError, match=message):
        train_tiny(dataset, tmp_path, recipe, begin=finished)


def test_a_run_that_is_not_finished_or_none_is_refused(
    dataset: Path, finished: Path, tmp_path: Path
) -> None:
    with pytest.raises(ZooError, match="is no run that can be extended"):
        train_tiny(dataset, tmp_path / "out", LONGER, begin=tmp_path / "nothing")
    with pytest.raises(ZooError, match="cannot begin from itself"):
        train_tiny(dataset, finished, LONGER, begin=finished)
    half = tmp_path / "half"
    shutil.copytree(finished, half)
    shutil.rmtree(half / "checkpoint")
    with pytest.raises(ZooError, match="no finished training, so there is no end to begin from"):
        train_tiny(dataset, tmp_path / "out", LONGER, begin=half)
    splits = make_splits()
    splits["train"]["r_img"] = splits["train"]["r_img"][::-1].copy()
    other = write_dataset(tmp_path / "other", splits)
    with pytest.raises(ZooError, match="dataset was"):
        train_tiny(other, tmp_path / "out", LONGER, begin=finished)


def test_patience_that_ended_it_has_to_be_raised(dataset: Path, tmp_path: Path) -> None:
    short = changed(epochs=30, patience=2, learning_rate=1e-9)
    train_tiny(dataset, tmp_path / "a", short, make_model(dropout=0.0, norm=False))
    longer = short.model_copy(update={"epochs": 40})
    with pytest.raises(ZooError, match="patience 2"):
        train_tiny(
            dataset,
            tmp_path / "b",
            longer,
            make_model(dropout=0.0, norm=False),
            begin=tmp_path / "a",
        )
    patient = short.model_copy(update={"patience": 4})
    train_tiny(
        dataset, tmp_path / "c", patient, make_model(dropout=0.0, norm=False), begin=tmp_path / "a"
    )
    metrics = json.loads((tmp_path / "c/checkpoint/metrics.json").read_text())
    assert len(metrics["history"]) == 5


@pytest.mark.parametrize("name", MODELS)
def test_every_model_can_be_extended(name: str, tmp_path: Path) -> None:
    dataset = write_rows(tmp_path / "data")
    one = SMALLEST_RECIPE.model_copy(update={"epochs": 1})
    common = (None, MACHINE)
    train(name, "small", dataset, one, tmp_path / "a", *common, **SMALLEST[name])
    begin = tmp_path / "a"
    train(name, "small", dataset, SMALLEST_RECIPE, tmp_path / "b", *common, begin, **SMALLEST[name])
    train(name, "small", dataset, SMALLEST_RECIPE, tmp_path / "c", *common, **SMALLEST[name])
    assert same(tmp_path / "b", tmp_path / "c")
