"""Every model of the zoo becomes a bundle that keeps its contract."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import onnxruntime
import pytest
import torch
from torch import Tensor

from graspe_data.bundle_contract import (
    CONTRACT_FILE,
    ENCODE_GRAPH,
    PARITY_FILE,
    RECORDED_FILE,
    SCORE_GRAPH,
    SEALED_FILES,
    BundleContract,
)
from graspe_data.errors import ZooError
from graspe_data.sealed_folder import SEAL_FILE, Seal
from graspe_data.shards.dataset_index import read_index
from model_zoo.checkpoints import Checkpoint, load_checkpoint
from model_zoo.contract import Features, Observation, SuccessModel
from model_zoo.export import export_bundle
from model_zoo.export.graphs import Graphs
from model_zoo.export.parity import ParityReport
from model_zoo.registry import MODELS
from tests.model_zoo.export.made import SHAPES, Made, last_layer, lively_model, write_made


@pytest.mark.parametrize("name", MODELS)
def test_a_model_becomes_a_bundle(name: str, dataset: Path, tmp_path: Path) -> None:
    index = read_index(dataset)
    checkpoint = write_made(tmp_path / "checkpoint", name, index)
    bundle = export_bundle(checkpoint, tmp_path / "bundle", dataset)
    made = Made(name, dataset, index, checkpoint, bundle)
    expect_all_files_sealed(made)
    expect_graphs_as_the_contract_says(made)
    expect_the_origin_in_the_contract(made)
    expect_parity_on_real_and_adverse_rows(made)
    expect_recorded_outputs_to_be_the_models(made)
    expect_no_trace_of_the_machine(made)


@pytest.mark.parametrize("name", MODELS)
@pytest.mark.parametrize("blind", ["to all", "to candidates"])
def test_a_model_that_does_not_look_is_not_exported(
    name: str, blind: str, dataset: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("model_zoo.export.export.export_graphs", no_graphs)
    model = lively_model(name)
    if blind == "to candidates":
        if "trajectory_image" not in model.columns:
            pytest.skip("it has none to look at")
        model.score = blinded(model)  # type: ignore[method-assign, assignment]
        monkeypatch.setattr("model_zoo.export.export.load_checkpoint", keep(model))
    else:
        torch.nn.init.zeros_(last_layer(model).weight)
    checkpoint = write_made(tmp_path / "checkpoint", name, read_index(dataset), model=model)
    reason = r"same in \d scenes" if blind == "to all" else r"same of \d candidates"
    with pytest.raises(ZooError, match=rf"{name}: its output is the {reason}, .* No bundle was"):
        export_bundle(checkpoint, tmp_path / "bundle", dataset)
    assert not (tmp_path / "bundle").exists()


BRANCHES = {
    "graspe": {
        "image": "encoders.image",
        "points": "encoders.points",
        "velocity_history": "encoders.velocit",
    },
    "paad": {"image": "image.", "laser_scan": "scan."},
    "nmfnet": {
        "image": "scene.image.",
        "points": "scene.point_net",
        "laser_scan": "scene.map.",
    },
}
"""By model the inputs, and how the parameters of their branches begin."""
BRANCHES |= dict.fromkeys(
    (name for name in MODELS if name.startswith("graspe_")), BRANCHES["graspe"]
)
BRANCHES["nmfnet_trajectory"] = BRANCHES["nmfnet"]


@pytest.mark.parametrize(
    ("name", "column"), [(name, column) for name in MODELS for column in BRANCHES.get(name, ())]
)
def test_a_model_that_does_not_look_at_one_input_is_not_exported(
    name: str, column: str, dataset: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("model_zoo.export.export.export_graphs", no_graphs)
    model, branch = lively_model(name), BRANCHES[name][column]
    dead = [weights for key, weights in model.named_parameters() if key.startswith(branch)]
    assert dead
    with torch.no_grad():
        for weights in dead:
            weights.zero_()
    checkpoint = write_made(tmp_path / "checkpoint", name, read_index(dataset), model=model)
    with pytest.raises(ZooError, match=rf"the same whatever its {column}"):
        export_bundle(checkpoint, tmp_path / "bundle", dataset)


def no_graphs(model: SuccessModel, temperature: float, example: Observation) -> Graphs:
    return Graphs(b"", b"", {})


def blinded(model: SuccessModel) -> Callable[[Features, Observation], Tensor]:
    """Scores that are those of an empty trajectory image, whatever the candidates."""
    score = model.score

    def seen(features: Features, candidates: Observation) -> Tensor:
        image = torch.zeros_like(candidates["trajectory_image"])
        return score(features, {**candidates, "trajectory_image": image})

    return seen


def keep(model: SuccessModel) -> Callable[[Path], Checkpoint]:
    def load(path: Path) -> Checkpoint:
        return replace(load_checkpoint(path), model=model)

    return load


def expect_all_files_sealed(made: Made) -> None:
    assert {path.name for path in made.bundle.iterdir()} == {*SEALED_FILES, SEAL_FILE}
    seal = Seal.model_validate(read(made.bundle / SEAL_FILE))
    for name, entry in seal.files.items():
        assert (made.bundle / name).stat().st_size == entry.bytes


def expect_graphs_as_the_contract_says(made: Made) -> None:
    promise = contract(made)
    encode, score = (session(made.bundle / graph) for graph in (ENCODE_GRAPH, SCORE_GRAPH))
    types = {"tensor(float)": "float32", "tensor(uint8)": "uint8", "tensor(int32)": "int32"}
    for nodes, tensors in (
        (encode.get_inputs(), promise.encode_inputs),
        (encode.get_outputs(), promise.features),
        (score.get_inputs(), (*promise.features, *promise.score_inputs)),
        (score.get_outputs(), (promise.output,)),
    ):
        found = [(node.name, types[node.type], tuple(node.shape)) for node in nodes]
        assert found == [(tensor.name, tensor.dtype, tensor.shape) for tensor in tensors]


def expect_the_origin_in_the_contract(made: Made) -> None:
    promise, checkpoint = contract(made), load_checkpoint(made.checkpoint)
    assert (promise.model, promise.preset) == (made.name, "small")
    assert promise.checkpoint_digest == checkpoint.digest
    assert promise.dataset_digest == made.index.dataset_digest
    assert promise.temperature == 1.7
    assert promise.observation.image_reliability.saturation_corners == 800
    assert promise.robot.camera is not None
    assert promise.robot.camera.fx == 277.0
    columns = {tensor.name for tensor in (*promise.encode_inputs, *promise.score_inputs)}
    assert columns == set(checkpoint.model.columns)
    assert promise.uses_candidates == ("trajectory_image" in columns)


def expect_parity_on_real_and_adverse_rows(made: Made) -> None:
    parity = report(made)
    assert parity.largest_difference <= 2e-5 < parity.tolerance == 1e-4
    assert {case.kind for case in parity.cases} == {"real", "adverse"}
    tried = {case.scene for case in parity.cases}
    columns = set(load_checkpoint(made.checkpoint).model.columns)
    assert {"test_0", "test_3", "empty_cloud"} <= tried
    assert ({"black_image", "white_image"} <= tried) == ("image" in columns)
    assert ("no_reliability" in tried) == ("r_img" in columns)
    counts = {1, 2, 7, 100} if "trajectory_image" in columns else {1}
    assert {case.candidates for case in parity.cases} == counts


def expect_recorded_outputs_to_be_the_models(made: Made) -> None:
    """To be those of the first row, and to depend on scenes and candidates."""
    checkpoint, cases = load_checkpoint(made.checkpoint), report(made).cases
    with np.load(made.bundle / RECORDED_FILE, allow_pickle=False) as recorded:
        outputs = [recorded[f"{case.scene}/success_{case.candidates}"] for case in cases]
        scene = {
            name: recorded[f"test_0/{name}"] for name in SHAPES if f"test_0/{name}" in recorded
        }
        if contract(made).uses_candidates:
            scene["trajectory_image"] = recorded["trajectory_image"][:1]
    first = checkpoint.predict({name: torch.from_numpy(array) for name, array in scene.items()})
    np.testing.assert_array_equal(outputs[0], first.numpy())
    assert np.concatenate(outputs).std(axis=0).max() > 0.01
    if contract(made).uses_candidates:
        (many,) = (output for output in outputs if len(output) == 100)
        assert many.std(axis=0).max() > 20 * report(made).largest_difference


def expect_no_trace_of_the_machine(made: Made) -> None:
    here = str(Path(__file__).resolve().parents[3]).encode()
    assert not any(here in path.read_bytes() for path in made.bundle.iterdir())


def read(path: Path) -> Any:
    return json.loads(path.read_text())


def contract(made: Made) -> BundleContract:
    return BundleContract.model_validate(read(made.bundle / CONTRACT_FILE))


def report(made: Made) -> ParityReport:
    return ParityReport.model_validate(read(made.bundle / PARITY_FILE))


def session(graph: Path) -> Any:
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = 1
    return onnxruntime.InferenceSession(str(graph), options, providers=["CPUExecutionProvider"])
