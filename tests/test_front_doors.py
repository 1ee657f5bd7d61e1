"""What a user imports first: one import each, and no more loaded than is needed."""

from __future__ import annotations

import importlib
import subprocess
import sys

import pytest

from pipelines.command_line import COMMANDS
from pipelines.lazy_commands import loaded

HEAVY = {"torch", "onnxruntime", "cv2", "rosbags", "matplotlib", "open3d", "sklearn"}
OWN = ("graspe_data", "model_zoo", "planners", "pipelines")


def modules_after(code: str) -> set[str]:
    told = "import sys; sys.stderr.write(' '.join(sys.modules))"
    run = [sys.executable, "-c", f"{code}\n{told}"]
    return set(subprocess.run(run, check=True, capture_output=True, text=True).stderr.split())


@pytest.mark.parametrize("package", ["graspe_data", "model_zoo", "planners"])
def test_every_name_of_a_door_is_there(package: str) -> None:
    door = importlib.import_module(package)
    for name in door.__all__:
        assert getattr(door, name) is not None
    with pytest.raises(AttributeError, match=f"module '{package}' has no attribute 'nothing'"):
        door.nothing  # noqa: B018


@pytest.mark.parametrize("package", ["graspe_data", "model_zoo", "planners"])
def test_a_door_loads_nothing_heavy(package: str) -> None:
    assert not modules_after(f"import {package}") & (HEAVY | {"numpy"})


def test_a_planner_needs_no_torch() -> None:
    assert "torch" not in modules_after("from planners import Situation, load_planner")


def test_help_imports_no_command() -> None:
    call = "from pipelines.command_line import app\napp(['--help'], standalone_mode=False)"
    loaded_now = modules_after(call)
    own = {name for name in loaded_now if name.partition(".")[0] in OWN}
    assert len(own) <= 10
    assert not loaded_now & (HEAVY | {"numpy", "pydantic"})


@pytest.mark.parametrize("name", COMMANDS)
def test_the_sentence_of_a_command_is_its_own(name: str) -> None:
    command = loaded(name, COMMANDS[name])
    assert (command.help or "").partition("\n")[0] == COMMANDS[name].help
