"""``graspe export``, and what it writes, in a process that has neither torch nor the zoo."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import torch
from typer.testing import CliRunner, Result

from graspe_data.bundle_contract import CONTRACT_FILE, PARITY_FILE, BundleContract
from model_zoo.checkpoints import TrainedModel, write_checkpoint
from model_zoo.checkpoints.assumptions import read_assumptions
from model_zoo.registry import create_model, model_settings
from pipelines.command_line import app
from pipelines.dataset_settings import load_recipe
from pipelines.index import dataset_index
from pipelines.row_columns import row_columns

ALONE = """
import json, sys
from importlib.abc import MetaPathFinder
from pathlib import Path

ABSENT = {"torch", "model_zoo", "pipelines", "rosbags", "onnx", "onnxscript", "safetensors"}

class Absent(MetaPathFinder):
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in ABSENT:
            raise ModuleNotFoundError(f"{name} is not here", name=name)

sys.meta_path.insert(0, Absent())
import numpy as np
from planners.bundle import load_bundle

folder = Path(sys.argv[1])
bundle = load_bundle(folder, threads=1)
report = json.loads((folder / "parity.json").read_text())
differences = []
with np.load(folder / "recorded.npz", allow_pickle=False) as recorded:
    for case in report["cases"]:
        scene, count = case["scene"], case["candidates"]
        names = [name for name in recorded.files if name.startswith(scene + "/")]
        inputs = {name.partition("/")[2]: recorded[name] for name in names}
        inputs["trajectory_image"] = recorded["trajectory_image"][:count]
        found = bundle.score(bundle.encode(inputs), inputs)
        differences.append(float(np.abs(found - inputs[f"success_{count}"]).max()))
print(json.dumps({"differences": differences, "loaded": sorted(ABSENT & set(sys.modules))}))
"""


def run(*words: object) -> Result:
    return CliRunner().invoke(app, ["export", *(str(word) for word in words)])


@pytest.fixture(scope="module")
def checkpoint(tmp_path_factory: pytest.TempPathFactory) -> Path:
    recipe = load_recipe("field")
    index = dataset_index(recipe, row_columns(recipe), [], {})
    torch.manual_seed(0)
    trained = TrainedModel(
        model_name="paad",
        preset="small",
        numbers=model_settings("paad", "small").model_dump(mode="json"),
        model=create_model("paad", "small"),
        columns=index.columns,
        recipe={},
        dataset_digest="d" * 64,
        metrics={},
        calibration=None,
        assumptions=read_assumptions(index),
    )
    return write_checkpoint(tmp_path_factory.mktemp("export") / "checkpoint", trained)


@pytest.fixture(scope="module")
def exported(checkpoint: Path) -> tuple[Path, Result]:
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    bundle = checkpoint.with_name("bundle")
    result = run(checkpoint, "--out", bundle)
    torch.set_num_threads(before)
    return bundle, result


def test_the_command_tells_how_far_both_agree(exported: tuple[Path, Result]) -> None:
    bundle, result = exported
    assert result.exit_code == 0, result.output
    assert f"{bundle}: onnxruntime and torch agree to" in result.stdout
    report = json.loads((bundle / PARITY_FILE).read_text())
    assert report["largest_difference"] <= report["tolerance"]


def test_the_pipelines_settings_are_the_contracts(exported: tuple[Path, Result]) -> None:
    content = json.loads((exported[0] / CONTRACT_FILE).read_text())
    contract, recipe = BundleContract.model_validate(content), load_recipe("field")
    assert contract.observation == recipe.observation
    assert contract.observation.image_reliability == recipe.dataset.image_reliability
    assert contract.observation.point_reliability == recipe.dataset.point_reliability
    assert contract.observation.history_step_s == recipe.dataset.window.history_step_s
    assert contract.robot.limits == recipe.robot.limits
    assert contract.robot.unknown["camera"] == "the dataset does not tell"


def test_a_bundle_stands_alone(exported: tuple[Path, Result]) -> None:
    done = subprocess.run(
        [sys.executable, "-c", ALONE, exported[0]], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    printed = json.loads(done.stdout)
    assert printed["loaded"] == []
    assert len(printed["differences"]) == 9
    assert np.max(printed["differences"]) < 1e-5


def test_json_is_a_report_and_thresholds_are_kept(checkpoint: Path, tmp_path: Path) -> None:
    thresholds = ("--acceptance", 0.8, "--reliability", 0.6)
    result = run(checkpoint, "--out", tmp_path / "bundle", "--json", *thresholds)
    printed = json.loads(result.stdout)
    content = json.loads((tmp_path / "bundle" / CONTRACT_FILE).read_text())
    assert (content["decision"]["acceptance"], content["decision"]["reliability"]) == (0.8, 0.6)
    assert printed["bundle"] == str(tmp_path / "bundle")
    assert {"cases", "largest_difference", "tolerance"} <= printed["parity"].keys()


def test_a_threshold_is_a_probability(checkpoint: Path, tmp_path: Path) -> None:
    result = run(checkpoint, "--out", tmp_path / "bundle", "--acceptance", 1.2)
    assert result.exit_code == 2
    assert "--acceptance" in result.output
    assert not (tmp_path / "bundle").exists()


def test_no_checkpoint_is_a_plain_text(tmp_path: Path) -> None:
    result = run(tmp_path, "--out", tmp_path / "bundle")
    assert result.exit_code == 1
    assert "manifest.json: missing" in str(result.exception)
