"""A model from outside trains, loads, is evaluated and exported; unknown, it is told how."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import pytest

from graspe_data.errors import ZooError
from model_zoo.checkpoints import load_checkpoint
from model_zoo.evaluation.evaluate import evaluate
from model_zoo.export import export_bundle
from model_zoo.known_models import GROUP, VARIABLE, known_models
from model_zoo.registry import MODELS, create_model, list_models, model_settings
from model_zoo.training.train import train
from tests.model_zoo.export.made import write_dataset, write_made
from tests.model_zoo.training.smallest import BEAMS, COLUMNS, HORIZON, RECIPE, make_rows
from tests.model_zoo.training.tiny import MACHINE
from tests.model_zoo.training.tiny import write_dataset as write_rows

NAME = "lidar_glance"
MODULE = "tests.model_zoo.outside.lidar_glance"


@pytest.fixture
def registered(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(VARIABLE, MODULE)


def install(folder: Path, points: str) -> None:
    """What pip leaves of a package that has these entry points."""
    metadata = folder / "some_models-1.0.dist-info"
    metadata.mkdir(parents=True)
    (metadata / "METADATA").write_text("Metadata-Version: 2.1\nName: some-models\nVersion: 1.0\n")
    (metadata / "entry_points.txt").write_text(f"[{GROUP}]\n{points}\n")


@pytest.mark.usefixtures("registered")
def test_it_trains_loads_and_is_evaluated(tmp_path: Path) -> None:
    splits = ("train", "validation", "test")
    rows = {split: make_rows(20, place, place) for place, split in enumerate(splits)}
    dataset = write_rows(tmp_path / "dataset", rows, COLUMNS)
    numbers = {"horizon": HORIZON, "beams": BEAMS}
    folder = train(NAME, "small", dataset, RECIPE, tmp_path / "run", None, MACHINE, **numbers)
    checkpoint = load_checkpoint(folder)
    assert (checkpoint.config.model, checkpoint.config.preset) == (NAME, "small")
    assert checkpoint.config.numbers == model_settings(NAME, "small", **numbers).model_dump()
    evaluation = evaluate(checkpoint, dataset, "test", ("clean",), resamples=20)
    assert evaluation.model == NAME


@pytest.mark.usefixtures("registered")
def test_it_becomes_a_bundle_with_parity(tmp_path: Path) -> None:
    index = write_dataset(tmp_path / "dataset")
    checkpoint = write_made(tmp_path / "checkpoint", NAME, index)
    bundle = export_bundle(checkpoint, tmp_path / "bundle", tmp_path / "dataset")
    parity = json.loads((bundle / "parity.json").read_text())
    assert parity["largest_difference"] < 1e-4


def test_a_checkpoint_of_it_says_how_to_register_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    index = write_dataset(tmp_path / "dataset")
    with monkeypatch.context() as context:
        context.setenv(VARIABLE, MODULE)
        checkpoint = write_made(tmp_path / "checkpoint", NAME, index)
    with pytest.raises(ZooError, match=rf"no model '{NAME}'.*{GROUP}.*{VARIABLE}"):
        load_checkpoint(checkpoint)


@pytest.mark.parametrize("place", [MODULE, f"{MODULE}:LidarGlance"])
def test_an_entry_point_registers_it(
    place: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    install(tmp_path, f"glance = {place}")
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setenv(VARIABLE, f" {'' if place == MODULE else ','}")
    assert list(known_models()) == [*MODELS, NAME]
    assert list_models()[NAME] == ("paper", "small")
    assert create_model(NAME, horizon=4).horizon == 4


@pytest.mark.parametrize(
    ("source", "message"),
    [
        (None, "GRASPE_MODELS: own_models cannot be imported: No module named"),
        ("1 / 0", "own_models cannot be imported: division by zero"),
        ("", "own_models has no model: expected a subclass of"),
        (
            "from model_zoo.models.paad import Paad\nclass Own(Paad):\n    name = 'paad'",
            "own_models has a model 'paad', a name that is taken by model_zoo.models.paad",
        ),
    ],
)
def test_a_module_that_does_not_fit_is_named(
    source: str | None, message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    if source is not None:
        (tmp_path / "own_models.py").write_text(source)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.delitem(sys.modules, "own_models", raising=False)
    monkeypatch.setenv(VARIABLE, "own_models")
    with pytest.raises(ZooError, match=message):
        known_models()


def test_its_presets_lie_beside_it_and_extend_another_models(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "wider_models.py").write_text(
        "from model_zoo.models.paad import Paad\nclass Wider(Paad):\n    name = 'wider_paad'"
    )
    (tmp_path / "wider_paad.yaml").write_text(
        "extends: paad\npresets: {small: {hidden: 256}, wide: {hidden: 512}}"
    )
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setenv(VARIABLE, "wider_models")
    expected = model_settings("paad", "small").model_dump() | {"hidden": 256}
    assert model_settings("wider_paad", "small").model_dump() == expected
    assert list_models()["wider_paad"] == (*list_models()["paad"], "wide")
    (tmp_path / "wider_paad.yaml").write_text("extends: wider_paad")
    with pytest.raises(ZooError, match="extends 'wider_paad', expected another model"):
        list_models()
