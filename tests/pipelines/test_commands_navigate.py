"""``graspe navigate``: trials, tables and pictures from the command line."""

from __future__ import annotations

import csv
import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import cv2
import pytest
import yaml
from typer.testing import CliRunner, Result

from pipelines.command_line import app

LANE: dict[str, Any] = {
    "name": "lane",
    "goal": [3.0, 0.0],
    "world": {
        "length": 12.0,
        "width": 6.0,
        "start": [-3.0, 0.0, 0.0],
        "ground": {"amplitude": 0.0, "cell": 1.0},
        "features": [
            {"kind": "pillar", "at": [[0.0, 1.8]]},
            {"kind": "tall_grass", "at": [[1.0, -1.5]], "radius": [0.8, 0.8]},
            {"kind": "hanging_leaves", "at": [[-0.5, -1.5]]},
        ],
    },
    "light": {"sky": "overcast"},
    "camera": {"width": 80, "height": 60},
    "lidar": {"rotation_rate": 20.0, "sub_rays": 1},
}
CONFIG = {"trial": {"time_limit_s": 1.5, "control_period_s": 0.2}, "dwa_lab": {"radius": 0.5}}
METHODS = ("--method", "dwa_fox", "--method", "dwa_lab")


@pytest.fixture
def scenario(tmp_path: Path) -> Path:
    path = tmp_path / "lane.yaml"
    path.write_text(yaml.safe_dump(LANE))
    return path


@pytest.fixture
def config(tmp_path: Path) -> Path:
    path = tmp_path / "trials.yaml"
    path.write_text(yaml.safe_dump(CONFIG))
    return path


def graspe(*words: object) -> Result:
    return CliRunner().invoke(app, [str(word) for word in words])


def navigate(scenario: Path, config: Path, out: Path, *more: object) -> Result:
    report = ("--config", config, "--out", out, "--trials", 2, *more)
    return graspe("navigate", "run", scenario, *METHODS, *report)


def test_all_methods_meet_the_same_seeds(scenario: Path, config: Path, tmp_path: Path) -> None:
    result = navigate(scenario, config, tmp_path / "out", "--seed", 7, "--json")
    assert result.exit_code == 0, result.output
    report = json.loads(result.stdout)
    assert [(trial["method"], trial["seed"]) for trial in report] == [
        (method, seed) for seed in (7, 8) for method in ("dwa_fox", "dwa_lab")
    ]
    assert {trial["outcome"] for trial in report} == {"timeout"}


def test_another_goal_can_be_driven_to(scenario: Path, config: Path, tmp_path: Path) -> None:
    result = navigate(scenario, config, tmp_path / "out", "--goal", "2", "-1.5")
    assert result.exit_code == 0, result.output
    kept = json.loads((tmp_path / "out" / "lane" / "conditions.json").read_text())
    assert kept["scenario"]["goal"] == [2.0, -1.5]


def test_it_prints_what_came_of_each_method(scenario: Path, config: Path, tmp_path: Path) -> None:
    result = navigate(scenario, config, tmp_path / "out")
    assert result.exit_code == 0, result.output
    assert result.stdout.count("2 timeout") == 2


def test_tables_are_made_of_the_files(scenario: Path, config: Path, tmp_path: Path) -> None:
    navigate(scenario, config, tmp_path / "out")
    result = graspe("navigate", "table", tmp_path / "out", "--method", "dwa_lab")
    assert result.exit_code == 0, result.output
    assert result.stdout.strip() == (tmp_path / "out" / "navigation.md").read_text().strip()
    assert "| dwa_lab | 0 (0 to 66; n = 2) |" in result.stdout
    rows = list(csv.DictReader((tmp_path / "out" / "navigation.csv").open()))
    assert [(row["method"], row["timeout"]) for row in rows] == [("dwa_lab", "2")]
    result = graspe("navigate", "table", tmp_path / "out", "--out", tmp_path / "there", "--json")
    assert [record["method"] for record in json.loads(result.stdout)] == ["dwa_fox", "dwa_lab"]
    assert (tmp_path / "there" / "navigation.csv").is_file()


def test_a_world_is_drawn_with_all_ways(scenario: Path, config: Path, tmp_path: Path) -> None:
    navigate(scenario, config, tmp_path / "out", "--seed", 7)
    result = graspe("navigate", "picture", tmp_path / "out", "lane", 7)
    assert result.exit_code == 0, result.output
    drawn = cv2.imread(str(tmp_path / "out" / "lane" / "7.png"))
    assert drawn is not None
    assert min(drawn.shape[:2]) > 400
    again = tmp_path / "again.png"
    graspe("navigate", "picture", tmp_path / "out", "lane", 7, "--out", again)
    assert again.read_bytes() == (tmp_path / "out" / "lane" / "7.png").read_bytes()


def test_a_picture_of_no_trial_is_refused(tmp_path: Path) -> None:
    result = graspe("navigate", "picture", tmp_path, "lane", 7)
    assert result.exit_code == 1
    assert "no trials of seed 7" in str(result.exception)


def test_an_unknown_setting_is_named(scenario: Path, tmp_path: Path) -> None:
    config = tmp_path / "trials.yaml"
    config.write_text(yaml.safe_dump({"trial": {"time_limit": 5}}))
    result = navigate(scenario, config, tmp_path / "out")
    assert result.exit_code == 1
    assert "Did you mean 'time_limit_s'?" in str(result.exception)


@pytest.mark.parametrize(
    ("missing", "extra"), [("open3d", "graspe[simulation]"), ("onnxruntime", "graspe[planner]")]
)
def test_what_is_not_installed_is_named(
    missing: str, extra: str, scenario: Path, tmp_path: Path
) -> None:
    without = f"import sys; sys.modules[{missing!r}] = None; "
    called = f"{without}from pipelines.command_line import main; main()"
    result = subprocess.run(
        [sys.executable, "-c", called, "navigate", "run", scenario, *METHODS],
        capture_output=True,
        text=True,
        check=False,
        cwd=tmp_path,
    )
    assert result.returncode == 1
    assert f"pip install '{extra}'" in result.stderr
    assert "Traceback" not in result.stderr
