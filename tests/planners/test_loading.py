"""A bundle and a robot to a planner in one call, as the README shows it."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from graspe_data.calibration import Calibration
from graspe_data.errors import ManifestError, PlannerError
from graspe_data.geometry import Transform
from graspe_data.robot import Robot
from planners import load_planner
from planners.fitness import GuardSettings
from planners.situation import Command
from tests.planners.every_planner import sound

README = Path(__file__).resolve().parents[2] / "README.md"


@pytest.fixture
def robot_file(tmp_path: Path, robot: Robot, calibration: Calibration) -> Path:
    """Spot's manifest, with the sensors of the tests in numbers."""
    content: dict[str, Any] = robot.model_dump(mode="json", exclude_none=True)
    content["camera"] |= {
        "intrinsics": calibration.intrinsics.model_dump(mode="json", exclude_none=True),
        "mounting": _mounting(calibration.base_from_camera),
    }
    content["lidar"] |= {"mounting": _mounting(calibration.base_from_lidar)}
    path = tmp_path / "robot.yaml"
    path.write_text(yaml.safe_dump(content))
    return path


def _mounting(transform: Transform) -> dict[str, list[float]]:
    r = transform.rotation
    rpy = [np.arctan2(r[2, 1], r[2, 2]), -np.arcsin(r[2, 0]), np.arctan2(r[1, 0], r[0, 0])]
    return {
        "translation": transform.translation.tolist(),
        "rotation_rpy": [float(angle) for angle in rpy],
    }


def test_the_readme_s_snippet_drives(
    bundle_path: Path, robot_file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    code = re.search(r"```python\n(.*?)```", README.read_text(), re.DOTALL)
    assert code is not None
    monkeypatch.chdir(robot_file.parent)
    (robot_file.parent / "bundle").symlink_to(bundle_path)
    known: dict[str, Any] = {"situation": sound()}
    exec(code[1], known)  # noqa: S102 - the README's own words
    command = known["command"]
    assert isinstance(command, Command)
    assert command.reason == ""
    assert command.linear_velocity > 0


def test_another_robot_is_refused(bundle_path: Path, robot_file: Path) -> None:
    content = yaml.safe_load(robot_file.read_text())
    content["camera"]["mounting"]["translation"][2] += 0.6
    robot_file.write_text(yaml.safe_dump(content))
    with pytest.raises(PlannerError, match=r"camera"):
        load_planner(bundle_path, robot_file)


def test_what_the_manifest_leaves_open_may_be_given(
    bundle_path: Path, robot: Robot, calibration: Calibration
) -> None:
    with pytest.raises(PlannerError, match="is left to"):
        load_planner(bundle_path, robot)
    guard = GuardSettings(answer_s=30.0)
    planner = load_planner(bundle_path, robot, calibration=calibration, guard=guard)
    assert planner.command(sound()).reason == ""


def test_no_such_robot_names_those_that_ship(bundle_path: Path) -> None:
    with pytest.raises(ManifestError, match="Did you mean 'spot'"):
        load_planner(bundle_path, "spott")
