"""A bundle is used only when all of it is what its seal and its contract say."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from graspe_data.bundle_contract import (
    CONTRACT_FILE,
    ENCODE_GRAPH,
    PARITY_FILE,
    RECORDED_FILE,
    SCORE_GRAPH,
    SEAL_FILE,
    SEALED_FILES,
)
from graspe_data.errors import PlannerError
from planners.bundle import Bundle, load_bundle
from planners.recorded_check import recorded_deviation
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
from planners.recorded_check import recorded_deviation
print(recorded_deviation(load_bundle(pathlib.Path({str(bundle_path)!r}))) < 1e-6)
"""
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=False
    )
    assert done.stdout.strip() == "True", done.stderr


def test_outputs_that_differ_from_the_recorded_ones(copy: Path) -> None:
    (copy / RECORDED_FILE).write_bytes(recorded(offset=0.01))
    seal(copy)
    with pytest.raises(PlannerError, match=r"success differs by 0\.01 here, expected at most"):
        recorded_deviation(load_bundle(copy, threads=1))


@pytest.mark.parametrize("content", [b"", b"PK", b"\x80\x04."])
def test_a_record_that_is_none(copy: Path, content: bytes) -> None:
    (copy / RECORDED_FILE).write_bytes(content)
    seal(copy)
    with pytest.raises(PlannerError, match=f"{RECORDED_FILE}: cannot be read"):
        recorded_deviation(load_bundle(copy, threads=1))


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
    with pytest.raises(PlannerError, match=f"{name}: SHA-256"):
        load_bundle(copy)


def test_a_longer_file_is_not_read(copy: Path) -> None:
    with (copy / PARITY_FILE).open("ab") as file:
        file.write(b" ")
    with pytest.raises(PlannerError, match=f"{PARITY_FILE}: 3 bytes, expected at most 2"):
        load_bundle(copy)


def test_a_link_is_not_followed(copy: Path, bundle_path: Path) -> None:
    (copy / ENCODE_GRAPH).unlink()
    (copy / ENCODE_GRAPH).symlink_to(bundle_path / ENCODE_GRAPH)
    with pytest.raises(PlannerError, match="expected a plain file"):
        load_bundle(copy)


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


def test_an_output_that_is_no_probability(bundle: Bundle) -> None:
    features = {"brightness": np.full((1, 1), np.nan, np.float32)}
    with pytest.raises(PlannerError, match="success is not within"):
        bundle.score(features, _candidates(2))


def test_threads_have_to_be_some(bundle_path: Path) -> None:
    with pytest.raises(PlannerError, match="threads is 0"):
        load_bundle(bundle_path, threads=0)
