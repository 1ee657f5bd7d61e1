"""``graspe zoo``: every model on one dataset, under one budget, compared."""

from __future__ import annotations

import json
import re
import shutil
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
import torch
import yaml
from typer.testing import CliRunner, Result

from graspe_data.columns import Column
from graspe_data.errors import ZooError
from graspe_data.shards.dataset_index import (
    DatasetIndex,
    RecordingEntry,
    read_index,
    write_index,
)
from graspe_data.shards.shard_writer import write_shard
from pipelines.command_line import app

ROWS = 12
COMMON = {"unit": "", "frame": "", "meaning": "", "stage": "test"}
COLUMNS = (
    Column(name="image", dtype="uint8", shape=(240, 320, 3), **COMMON),
    Column(name="trajectory_image", dtype="uint8", shape=(240, 320), codec="packed_bits", **COMMON),
    Column(name="laser_scan", dtype="float32", shape=(720,), **COMMON),
    Column(name="velocity_history", dtype="float32", shape=(4, 2), **COMMON),
    Column(name="recording", dtype="int32", shape=(), **COMMON),
    Column(name="success", dtype="uint8", shape=(10,), **COMMON),
    Column(name="success_mask", dtype="bool", shape=(10,), **COMMON),
)


@pytest.fixture(autouse=True)
def one_thread() -> Iterator[None]:
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    yield
    torch.set_num_threads(before)


@pytest.fixture(scope="module")
def dataset(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("zoo") / "dataset"
    draw = np.random.default_rng(0)
    splits = {}
    for number, split in enumerate(("train", "validation", "test")):
        success = np.repeat(draw.random((ROWS, 1)) < 0.5, 10, axis=1)
        success[:2] = [[True], [False]]
        rows = {
            "image": draw.integers(0, 256, (ROWS, 240, 320, 3), np.uint8),
            "trajectory_image": np.packbits(draw.random((ROWS, 240, 320)) < 0.2, axis=-1),
            "laser_scan": draw.uniform(0.5, 10.0, (ROWS, 720)).astype(np.float32),
            "velocity_history": draw.normal(size=(ROWS, 4, 2)).astype(np.float32),
            "recording": np.full(ROWS, number, np.int32),
            "success": success.astype(np.uint8),
            "success_mask": np.ones((ROWS, 10), bool),
        }
        splits[split] = [write_shard(folder, f"shards/{split}.npz", COLUMNS, rows)]
    recordings = [
        RecordingEntry(name=split, digest=f"{number}" * 64, group=split, split=split, rows=ROWS)
        for number, split in enumerate(splits)
    ]
    index = DatasetIndex(
        name="zoo", columns=COLUMNS, group_key="place", splits=splits, recordings=recordings
    )
    write_index(folder, index)
    return folder


@pytest.fixture
def recipe(tmp_path: Path) -> Path:
    path = tmp_path / "recipe.yaml"
    path.write_text(yaml.safe_dump({"epochs": 1, "batch_size": 4, "most_steps": 2}))
    return path


def zoo(*words: object) -> Result:
    return CliRunner().invoke(app, ["zoo", *(str(word) for word in words)])


def test_the_list_names_presets_parameters_and_columns() -> None:
    report = json.loads(zoo("list", "--json").stdout)
    assert report["nmfnet"]["parameters"]["paper"] == 3_915_091
    assert report["paad"]["columns"] == ["image", "trajectory_image", "laser_scan"]
    assert set(report) == {
        "graspe",
        "graspe_gated",
        "graspe_no_agnn",
        "graspe_no_reliability",
        "graspe_plain_reliability",
        "graspe_self_aware",
        "nmfnet",
        "nmfnet_trajectory",
        "paad",
    }


def test_a_run_trains_evaluates_and_compares_and_does_nothing_twice(
    dataset: Path, recipe: Path, tmp_path: Path
) -> None:
    out = tmp_path / "runs"
    budget = ("--recipe", recipe, "--model", "paad", "--clean", "--workers", 0)
    words = ("run", "--data", dataset, "--out", out, *budget)
    result = zoo(*words)
    assert result.exit_code == 0, result.output
    assert "paad" in (out / "comparison" / "comparison.md").read_text()
    files = {path: path.stat().st_mtime_ns for path in (out / "paad-small-0").rglob("*.json")}
    assert zoo(*words).exit_code == 0
    assert {path: path.stat().st_mtime_ns for path in files} == files
    assert (out / "paad-small-0" / "evaluation-clean.json") in files  # a fuller one would stay


def test_a_finished_run_goes_on_to_more_epochs(dataset: Path, tmp_path: Path) -> None:
    recipe = tmp_path / "recipe.yaml"
    recipe.write_text(yaml.safe_dump({"epochs": 1, "batch_size": 4}))
    first, longer = tmp_path / "first", tmp_path / "longer"
    words = ("train", "paad", "--data", dataset, "--recipe", recipe, "--workers", 0)
    small = ("--set", "trunk_width=2")
    assert zoo(*words, "--out", first, *small).exit_code == 0
    result = zoo(*words, "--out", longer, "--from", first, "--epochs", 2, *small)
    assert result.exit_code == 0, result.output
    report = json.loads((longer / "checkpoint" / "metrics.json").read_text())
    assert (report["epochs"], report["steps"]) == (2, 6)
    config = json.loads((longer / "checkpoint" / "config.json").read_text())
    assert config["begins_from"]["step"] == 3
    result = zoo(*words, "--out", tmp_path / "other", "--from", first, "--epochs", 2)
    assert result.exit_code != 0
    assert "numbers.trunk_width was 2, is 16" in str(result.exception)


def test_training_and_evaluating_are_commands_of_their_own(
    dataset: Path, recipe: Path, tmp_path: Path
) -> None:
    run = tmp_path / "run"
    words = ("--data", dataset, "--out", run, "--recipe", recipe, "--workers", 0)
    result = zoo("train", "paad", *words, "--set", "trunk_width=12")
    assert result.exit_code == 0, result.output
    config = json.loads((run / "checkpoint" / "config.json").read_text())
    assert (config["preset"], config["numbers"]["trunk_width"]) == ("small", 12)
    result = zoo("evaluate", run / "checkpoint", "--data", dataset, "--clean")
    assert result.exit_code == 0, result.output
    assert "AU-ROC" in result.stdout
    result = zoo("compare", run / "evaluation-clean.json", "--out", tmp_path / "compared")
    assert result.exit_code == 0, result.output
    assert (tmp_path / "compared" / "comparison.csv").is_file()


def test_where_nothing_can_be_written_nothing_is_predicted(dataset: Path, tmp_path: Path) -> None:
    for out in (tmp_path, tmp_path / "nowhere" / "evaluation.json"):
        result = zoo("evaluate", tmp_path / "checkpoint", "--data", dataset, "--out", out)
        assert isinstance(result.exception, ZooError)
        assert str(result.exception).startswith(f"{out}: ")


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--model", "paad", "--model", "graspe"), "graspe needs the column points"),
        (("--model", "paad", "--model", "paad"), "the run paad-small-0 is asked for twice"),
        (("--model", "paad", "--split", "nope"), "no rows in the split 'nope'.* test 12"),
    ],
)
def test_a_run_checks_all_before_the_first_step(
    words: tuple[str, ...], message: str, dataset: Path, recipe: Path, tmp_path: Path
) -> None:
    out = tmp_path / "runs"
    result = zoo("run", "--data", dataset, "--out", out, "--recipe", recipe, *words)
    assert isinstance(result.exception, ZooError)
    assert re.search(message, str(result.exception))
    assert not out.exists()


def test_a_run_whose_test_drive_taught_is_refused_before_the_first_step(
    dataset: Path, recipe: Path, tmp_path: Path
) -> None:
    leaking, out = tmp_path / "leaking", tmp_path / "runs"
    shutil.copytree(dataset, leaking)
    index = read_index(leaking)
    worlds = {"train": "garden, seed 3", "validation": "garden, seed 4", "test": "garden, seed 3"}
    entries = [
        entry.model_copy(update={"details": {"world": worlds[entry.name]}})
        for entry in index.recordings
    ]
    write_index(leaking, index.model_copy(update={"recordings": entries}))
    said = zoo("run", "--data", leaking, "--out", out, "--recipe", recipe, "--model", "paad")
    assert isinstance(said.exception, ZooError)
    assert "test of the split 'test' and train of the split 'train'" in str(said.exception)
    assert "have the same world" in str(said.exception)
    assert not out.exists()


def test_a_run_looks_at_all_folders_before_the_first_step(
    dataset: Path, recipe: Path, tmp_path: Path
) -> None:
    out = tmp_path / "runs"
    out.mkdir()
    words = ("run", "--data", dataset, "--out", out, "--recipe", recipe, "--model", "paad")
    (out / "comparison").write_text("mine")
    assert "comparison: found a file" in str(zoo(*words).exception)
    (out / "comparison").unlink()
    (out / "paad-small-1").mkdir()
    (out / "paad-small-1/state.safetensors").write_bytes(b"x")
    assert "paad-small-1/state.safetensors: a damaged" in str(zoo(*words, "--seeds", 2).exception)
    assert not (out / "paad-small-0").exists()


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("train", "grasp"), "graspe"),
        (("train", "graspe"), "points"),
        (("train", "paad", "--recipe", "smal"), "small"),
        (("train", "paad", "--preset", "tiny"), "small"),
        (("train", "paad", "--set", "trunk_with=12"), "trunk_width"),
        (("train", "paad", "--set", "model_name=x"), "model_name"),
        (("train", "paad", "--set", "trunk_width=wide"), "trunk_width"),
    ],
)
def test_what_does_not_fit_is_one_clear_error(
    words: tuple[str, ...], message: str, dataset: Path, tmp_path: Path
) -> None:
    result = zoo(*words, "--data", dataset, "--out", tmp_path / "run")
    assert isinstance(result.exception, ZooError)
    assert message in str(result.exception)
