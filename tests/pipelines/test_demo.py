"""The demo: its recordings' names decide their splits, and it goes on where it stopped."""

from __future__ import annotations

from pathlib import Path

import pytest

from graspe_data.manifest import find_manifest, load_manifest
from graspe_data.progress import Silent
from graspe_data.robot import Robot
from graspe_data.simulation.scenario import Scenario
from pipelines import demo
from pipelines.dataset_settings import load_recipe
from pipelines.executors import Workers
from pipelines.splits import split_of
from tests.conftest import GARDEN

SPLITS = {"train": demo.TRAINING, "validation": demo.VALIDATION, "test": demo.TEST}


@pytest.fixture
def small(monkeypatch: pytest.MonkeyPatch) -> None:
    """Every scenario is the garden, driven for some seconds; one recording a split."""
    robot = load_manifest(find_manifest("robots", "spot"), Robot)
    monkeypatch.setattr(
        demo, "load_scenario", lambda name: (Scenario(**GARDEN | {"name": name}), robot)
    )
    monkeypatch.setattr(demo, "DURATION_S", 9.0)
    for part in ("TRAINING", "VALIDATION", "TEST"):
        monkeypatch.setattr(demo, part, getattr(demo, part)[:1])


@pytest.mark.parametrize("split", SPLITS)
def test_the_names_of_the_recordings_decide_their_splits(split: str) -> None:
    settings = load_recipe(demo.DATASET).dataset.split
    names = [recording.simulation().name for recording in SPLITS[split]]
    assert {split_of(name, "", settings, seed=0)[1] for name in names} == {split}


@pytest.mark.usefixtures("small")
def test_the_demo_fills_every_split_and_does_nothing_twice(tmp_path: Path) -> None:
    first = demo.run_demo(tmp_path, Workers(), Silent())
    assert [first.index.rows(split) > 0 for split in SPLITS] == [True] * 3
    recordings = sorted((tmp_path / "recordings").glob("*[!l]"))
    assert [path.name for path in recordings] == [
        "graspe_1_plants-1",
        "meadow-1.bag",
        "mixed-900.bag",
    ]
    before = [path.stat().st_mtime_ns for path in recordings]
    again = demo.run_demo(tmp_path, Workers(), Silent())
    assert again.worked_on == ()
    assert [path.stat().st_mtime_ns for path in recordings] == before
