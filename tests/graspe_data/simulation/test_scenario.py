"""Scenarios: manifests that say where and what is wrong with them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
import yaml

from graspe_data.errors import ManifestError
from graspe_data.manifest import shipped_manifests
from graspe_data.simulation.scenario import Scenario, load_scenario

SMALL: dict[str, Any] = {"name": "small", "world": {"length": 12.0, "width": 10.0}}


def load(folder: Path, **changed: object) -> Scenario:
    path = folder / "small.yaml"
    path.write_text(yaml.safe_dump(SMALL | changed))
    return load_scenario(path)[0]


def test_a_name_and_a_world_are_enough(tmp_path: Path) -> None:
    scenario = load(tmp_path)
    assert (scenario.name, scenario.duration_s, scenario.robot) == ("small", 60.0, "spot")
    assert scenario.occlusions == ()
    assert Scenario.model_validate(scenario.model_dump(mode="json")) == scenario


def test_the_robot_is_the_one_named_or_lies_beside(tmp_path: Path) -> None:
    path = tmp_path / "scenario.yaml"
    path.write_text(yaml.safe_dump(SMALL))
    _, spot = load_scenario(path)
    assert spot.name == "spot"
    beside = spot.model_copy(update={"name": "hopper"}).model_dump(mode="json")
    (tmp_path / "hopper.yaml").write_text(yaml.safe_dump(beside))
    path.write_text(yaml.safe_dump(SMALL | {"robot": "hopper.yaml"}))
    assert load_scenario(path)[1].name == "hopper"


@pytest.mark.parametrize("rate", [1, 2, 5, 10, 12.5, 20, 100])
def test_rates_that_fall_on_steps_are_kept(rate: float, tmp_path: Path) -> None:
    assert load(tmp_path, camera={"rate": rate}).camera.rate == rate


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"camera": {"rate": 30}}, "camera.rate: 30 Hz does not fit the simulation's step"),
        ({"rates": {"imu": 60}}, "rates.imu: 60 Hz does not fit"),
        ({"rates": {"imu": 200}}, "rates.imu"),
        ({"goal": [7.0, 0.0]}, "outside of the arena, which reaches to x = \\+-6 m"),
        ({"duration_s": 0}, "duration_s"),
        ({"name": "../up"}, "name"),
        ({"robot": "unicorn"}, "no manifest 'unicorn'"),
        ({"camrea": {}}, "camrea: unknown key. Did you mean 'camera'?"),
        ({"occlusions": [{"kind": "lens"}]}, "occlusions.0.lens.share"),
        ({"world": {"features": [{"kind": "dragon"}]}}, "dragon"),
    ],
)
def test_what_does_not_fit_is_named(changed: dict[str, object], said: str, tmp_path: Path) -> None:
    with pytest.raises(ManifestError, match=said):
        load(tmp_path, **changed)


def test_an_unknown_name_is_refused() -> None:
    with pytest.raises(ManifestError, match="scenarios: no manifest 'atlantis'"):
        load_scenario("atlantis")


@pytest.mark.parametrize(
    "path", sorted((shipped_manifests() / "scenarios").glob("*.yaml")), ids=lambda path: path.stem
)
def test_those_that_ship_are_called_as_their_files(path: Path) -> None:
    scenario, robot = load_scenario(path.stem)
    assert (scenario.name, scenario.robot) == (path.stem, robot.name)
