"""A bundle is used only when all of it is what its seal and its contract say."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any, cast

import numpy as np
import onnx
import onnx.numpy_helper
import pytest

from graspe_data.bundle_contract import (
    CONTRACT_FILE,
    ENCODE_GRAPH,
    PARITY_FILE,
    RECORDED_FILE,
    SCORE_GRAPH,
    SEALED_FILES,
)
from graspe_data.errors import PlannerError
from graspe_data.sealed_folder import SEAL_FILE
from planners.bundle import Bundle, load_bundle
from planners.graph import Arrays, Graph
from tests.planners.recorded_outputs import recorded_deviation
from tests.planners.tiny_bundle import (
    HEIGHT,
    HISTORY,
    POINTS,
    STEPS,
    WIDTH,
    encode_graph,
    recorded,
    seal,
)

BLOCKED = (
    "torch", "lightning", "model_zoo", "pipelines", "rosbags", "open3d", "onnx",
    "graspe_data.recordings", "graspe_data.shards", "graspe_data.simulation",
)  # fmt: skip


@pytest.fixture
def copy(bundle_path: Path, tmp_path: Path) -> Path:
    return shutil.copytree(bundle_path, tmp_path / "bundle")


def _observation(grey: int = 255) -> dict[str, np.ndarray[tuple[int, ...], np.dtype[np.generic]]]:
    return {
        "image": np.full((1, HEIGHT, WIDTH, 3), grey, np.uint8),
        "points": np.zeros((1, POINTS, 3), np.float32),
        "velocity_history": np.zeros((1, HISTORY, 2), np.float32),
    }


def _candidates(count: int) -> dict[str, np.ndarray[tuple[int, ...], np.dtype[np.generic]]]:
    images = np.zeros((count, HEIGHT, WIDTH), np.uint8)
    images[1::2, 20, 3] = 1
    return {"trajectory_image": images, "r_point": np.zeros(1, np.float32)}


@pytest.mark.parametrize("count", [1, 2, 7, 100])
def test_any_number_of_candidates_in_one_call(bundle: Bundle, count: int) -> None:
    success = bundle.score(bundle.encode(_observation()), _candidates(count))
    assert success.shape == (count, STEPS)
    assert success[::2] == pytest.approx(1.0)
    assert success[1::2] == pytest.approx(0.1)


def test_the_caller_goes_on_to_compute_with_subnormal_numbers(bundle: Bundle) -> None:
    bundle.score(bundle.encode(_observation()), _candidates(1))
    assert np.nextafter(0.0, 1.0) * np.float64(1.0) > 0


def test_stands_alone(bundle_path: Path) -> None:
    """In a process without torch, zoo and recordings it gives what was recorded."""
    script = f"""
import sys
class Blocked:
    def find_spec(self, name, path=None, target=None):
        if any(name == b or name.startswith(b + '.') for b in {BLOCKED!r}):
            raise ImportError(name)
sys.meta_path.insert(0, Blocked())
import pkgutil, importlib, pathlib, planners
for module in pkgutil.iter_modules(planners.__path__):
    importlib.import_module('planners.' + module.name)
from planners.bundle import load_bundle
from planners.graph import Arrays, Graph
from tests.planners.recorded_outputs import recorded_deviation
print(recorded_deviation(load_bundle(pathlib.Path({str(bundle_path)!r}))) < 1e-6)
"""
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=False
    )
    assert done.stdout.strip() == "True", done.stderr


def test_outputs_that_differ_from_the_recorded_ones(copy: Path) -> None:
    (copy / RECORDED_FILE).write_bytes(recorded(offset=0.01))
    seal(copy)
    assert recorded_deviation(load_bundle(copy, threads=1)) == pytest.approx(0.01, abs=1e-6)


@pytest.mark.parametrize("name", sorted({*SEALED_FILES, SEAL_FILE}))
def test_a_missing_file_is_named(copy: Path, name: str) -> None:
    (copy / name).unlink()
    with pytest.raises(PlannerError, match=f"{name}: missing"):
        load_bundle(copy)


@pytest.mark.parametrize("name", sorted(SEALED_FILES))
def test_a_changed_byte_is_named(copy: Path, name: str) -> None:
    content = bytearray((copy / name).read_bytes())
    content[len(content) // 2] ^= 1
    (copy / name).write_bytes(bytes(content))
    with pytest.raises(PlannerError, match=f"{name}: was changed or damaged: SHA-256"):
        load_bundle(copy)


def test_a_longer_file_is_not_read(copy: Path) -> None:
    with (copy / PARITY_FILE).open("ab") as file:
        file.write(b" ")
    with pytest.raises(PlannerError, match=f"{PARITY_FILE}: has 3 bytes, the seal says 2"):
        load_bundle(copy)


def test_a_link_is_followed_where_the_user_says_and_its_digest_is_checked(
    copy: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    disk = tmp_path / "disk" / "graph"
    disk.parent.mkdir()
    (copy / ENCODE_GRAPH).rename(disk)
    (copy / ENCODE_GRAPH).symlink_to(disk)
    with pytest.raises(PlannerError, match=f"a link to {disk}, .* GRASPE_LINKS={disk.parent} "):
        load_bundle(copy)
    monkeypatch.setenv("GRASPE_LINKS", str(disk.parent))
    load_bundle(copy)
    disk.write_bytes(disk.read_bytes()[:-1] + b"x")
    with pytest.raises(PlannerError, match=f"{ENCODE_GRAPH}: was changed or damaged: SHA-256"):
        load_bundle(copy)


def test_a_bundle_in_a_hubs_cache_is_loaded(copy: Path, tmp_path: Path) -> None:
    repository = tmp_path / "models--group--paad"
    snapshot = repository / "snapshots" / "0a1b"
    (repository / "blobs").mkdir(parents=True)
    snapshot.mkdir(parents=True)
    for number, file in enumerate(sorted(copy.iterdir())):
        file.rename(repository / "blobs" / str(number))
        (snapshot / file.name).symlink_to(f"../../blobs/{number}")
    assert load_bundle(snapshot).path == snapshot


@pytest.mark.parametrize("name", ["../other.onnx", "/elsewhere/other.onnx"])
def test_a_seal_of_other_files_is_refused(copy: Path, name: str) -> None:
    content = json.loads((copy / SEAL_FILE).read_text())
    content["files"][name] = content["files"].pop(ENCODE_GRAPH)
    (copy / SEAL_FILE).write_text(json.dumps(content))
    with pytest.raises(PlannerError, match=f"{SEAL_FILE}: lists .*other.onnx"):
        load_bundle(copy)


@pytest.mark.parametrize("text", ["", "[]", "{", "[" * 100_000, '{"format": 1}'])
@pytest.mark.parametrize("name", [SEAL_FILE, CONTRACT_FILE])
def test_documents_that_are_none(copy: Path, name: str, text: str) -> None:
    (copy / name).write_text(text)
    if name != SEAL_FILE:
        seal(copy)
    with pytest.raises(PlannerError, match=name):
        load_bundle(copy)


def test_an_unknown_key_of_the_contract_is_named(copy: Path) -> None:
    content = json.loads((copy / CONTRACT_FILE).read_text())
    (copy / CONTRACT_FILE).write_text(json.dumps({**content, "presett": "small"}))
    seal(copy)
    with pytest.raises(PlannerError, match=r"presett: unknown key\. Did you mean 'preset'"):
        load_bundle(copy)


def test_a_key_that_stands_twice_is_named(copy: Path) -> None:
    content = (copy / CONTRACT_FILE).read_text()
    (copy / CONTRACT_FILE).write_text('{"model": "other", ' + content[1:])
    seal(copy)
    with pytest.raises(PlannerError, match="not valid JSON: the key 'model' stands twice"):
        load_bundle(copy)


def test_a_graph_that_is_none(copy: Path) -> None:
    (copy / SCORE_GRAPH).write_bytes(b"no graph")
    seal(copy)
    with pytest.raises(PlannerError, match=f"{SCORE_GRAPH}: onnxruntime .* cannot run it"):
        load_bundle(copy)


def test_a_graph_that_gives_something_else(copy: Path) -> None:
    (copy / ENCODE_GRAPH).write_bytes(encode_graph("darkness"))
    seal(copy)
    with pytest.raises(PlannerError, match="outputs darkness, by its contract brightness"):
        load_bundle(copy)


def test_inputs_that_are_not_the_contract_s(bundle: Bundle) -> None:
    observation = _observation()
    with pytest.raises(PlannerError, match="points is missing"):
        bundle.encode({k: v for k, v in observation.items() if k != "points"})
    with pytest.raises(PlannerError, match=r"image is uint8 \(1, 3, 3\), by the contract uint8"):
        bundle.encode({**observation, "image": np.zeros((1, 3, 3), np.uint8)})
    with pytest.raises(PlannerError, match="image is float32"):
        bundle.encode({**observation, "image": observation["image"].astype(np.float32)})


@pytest.mark.parametrize(
    ("key", "changes", "reason"),
    [
        ("observation", {"horizon_steps": 9}, "horizon_steps and horizon differ: 9 and 10"),
        ("observation", {"horizon_step_s": 0.2}, "horizon_step_s and step_s differ"),
        ("observation", {"picture_size": [24, 30]}, "the camera's width differ: 30 and 32"),
        ("observation", {"history_steps": 7}, r"velocity_history has shape .* makes \(1, 7, 2\)"),
        ("robot", {"base_height": 5.0}, "base_height and robot.base_height differ: 0.5 and 5"),
        ("decision", {"step_weights": [0.0] * 10}, "step_weights sum to 0, not 1"),
    ],
)
def test_a_contract_that_contradicts_itself(
    copy: Path, key: str, changes: dict[str, Any], reason: str
) -> None:
    content = json.loads((copy / CONTRACT_FILE).read_text())
    content[key] |= changes
    (copy / CONTRACT_FILE).write_text(json.dumps(content))
    seal(copy)
    with pytest.raises(PlannerError, match=reason):
        load_bundle(copy)


def test_a_mounting_that_is_no_rotation(copy: Path) -> None:
    content = json.loads((copy / CONTRACT_FILE).read_text())
    pose = content["robot"]["base_from_lidar"]
    pose["rotation"] = (1000 * np.array(pose["rotation"])).tolist()
    (copy / CONTRACT_FILE).write_text(json.dumps(content))
    seal(copy)
    with pytest.raises(PlannerError, match="rotation is no rotation"):
        load_bundle(copy)


def test_a_graph_of_other_sizes_than_its_contract(copy: Path) -> None:
    content = json.loads((copy / CONTRACT_FILE).read_text())
    content["features"][0]["shape"] = [1, 2]
    (copy / CONTRACT_FILE).write_text(json.dumps(content))
    seal(copy)
    with pytest.raises(PlannerError, match=r"brightness is tensor\(float\) \(1, 1\), by its"):
        load_bundle(copy)


def test_weights_that_lie_in_no_sealed_file(
    copy: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    graph = onnx.load_from_string((copy / SCORE_GRAPH).read_bytes())
    (weight,) = (each for each in graph.graph.initializer if each.name == "weight")
    (tmp_path / "weights.bin").write_bytes(np.float32(0.1).tobytes())
    weight.ClearField("raw_data")
    weight.data_location = onnx.TensorProto.EXTERNAL
    weight.external_data.add(key="location", value="weights.bin")
    (copy / SCORE_GRAPH).write_bytes(graph.SerializeToString())
    seal(copy)
    monkeypatch.chdir(tmp_path)
    with pytest.raises(PlannerError, match=f"{SCORE_GRAPH}: onnxruntime .* cannot run it"):
        load_bundle(copy, threads=1)


def test_a_graph_that_gives_one_number_of_candidates(copy: Path) -> None:
    graph = onnx.load_from_string((copy / SCORE_GRAPH).read_bytes())
    (end,) = (each for each in graph.graph.initializer if each.name == "steps")
    end.CopyFrom(onnx.numpy_helper.from_array(np.ones((5, STEPS), np.float32), "steps"))
    (copy / SCORE_GRAPH).write_bytes(graph.SerializeToString())
    seal(copy)
    with pytest.raises(PlannerError, match=r"success is tensor\(float\) \(5, 10\), by its"):
        load_bundle(str(copy), threads=1)


def test_fewer_scores_than_candidates(bundle: Bundle) -> None:
    class One:
        def run(self, arrays: Arrays) -> Arrays:  # noqa: ARG002
            return {"success": np.ones((1, STEPS), np.float32)}

    with pytest.raises(PlannerError, match="success has 1 rows for 7 candidates"):
        replace(bundle, score_graph=cast("Graph", One())).score({}, _candidates(7))


def test_an_output_that_is_no_probability(bundle: Bundle) -> None:
    features = {"brightness": np.full((1, 1), np.nan, np.float32)}
    with pytest.raises(PlannerError, match="success is not within"):
        bundle.score(features, _candidates(2))


def test_threads_have_to_be_some(bundle_path: Path) -> None:
    with pytest.raises(PlannerError, match="threads is 0"):
        load_bundle(bundle_path, threads=0)


@pytest.mark.parametrize("threads", [None, 0, -1, 1.0, "2", True, 10**9])
def test_threads_are_a_whole_number(bundle_path: Path, threads: Any) -> None:
    with pytest.raises(PlannerError, match=r"threads is .*, and must be a whole number from 1"):
        load_bundle(bundle_path, threads)
