"""The dataset manifest: every knob, its default, and what is refused."""

from __future__ import annotations

from pathlib import Path

import pytest

from graspe_data.errors import ManifestError
from graspe_data.manifest import read_yaml, shipped_manifests
from pipelines.dataset_settings import DatasetManifest, load_recipe

SHIPPED = sorted((shipped_manifests() / "datasets").glob("*.yaml"))


@pytest.mark.parametrize("path", SHIPPED, ids=lambda path: path.stem)
def test_every_manifest_that_ships_loads_with_its_robot(path: Path) -> None:
    assert load_recipe(path.stem).dataset.name == path.stem


def test_the_manifest_to_copy_shows_every_knob_with_its_default() -> None:
    shown = read_yaml(shipped_manifests() / "datasets" / "graspe.yaml")
    defaults = DatasetManifest(name="graspe", robot="spot").model_dump(mode="json")
    assert shown == defaults


def test_a_robot_manifest_in_its_place_is_told_from_a_dataset_manifest() -> None:
    with pytest.raises(ManifestError, match=r"this is a robot manifest.*under `robot:`"):
        load_recipe(shipped_manifests() / "robots" / "spot.yaml")


def test_an_unknown_key_deep_inside_suggests_the_nearest(tmp_path: Path) -> None:
    path = tmp_path / "dataset.yaml"
    path.write_text("name: x\nrobot: spot\nwindow: {histroy_steps: 3}\n")
    with pytest.raises(ManifestError, match=r"window.histroy_steps.*'history_steps'"):
        load_recipe(path)


def test_a_missing_robot_names_those_that_ship(tmp_path: Path) -> None:
    path = tmp_path / "dataset.yaml"
    path.write_text("name: x\nrobot: spott\n")
    with pytest.raises(ManifestError, match=r"no manifest 'spott'.*kitti_car, .*spot, .*'spot'\?"):
        load_recipe(path)


def test_clocks_may_differ_from_recording_to_recording(tmp_path: Path) -> None:
    path = tmp_path / "dataset.yaml"
    path.write_text(
        "name: x\nrobot: spot\nrecording_clocks:\n"
        "  - {recordings: [monday*], points: {offset_s: 0.5}}\n"
        "  - {recordings: ['*'], points: {offset_s: measured}}\n"
    )
    recipe = load_recipe(path)
    monday, other = (recipe.for_recording(name).robot for name in ("monday_1.bag", "sunday.bag"))
    assert (monday.clocks.points.offset_s, other.clocks.points.offset_s) == (0.5, "measured")
    assert monday.clocks.odometry == recipe.robot.clocks.odometry
    assert recipe.robot.clocks.points.offset_s == 0.0
