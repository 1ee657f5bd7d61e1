from __future__ import annotations

import json
import shutil
from pathlib import Path

import numpy as np
import onnxruntime
import pytest

from graspe_data.bundle_contract import (
    CARD_FILE,
    CONTRACT_FILE,
    ENCODE_GRAPH,
    PARITY_FILE,
    RECORDED_FILE,
    SCORE_GRAPH,
    BundleContract,
    Thresholds,
)
from graspe_data.errors import ZooError
from model_zoo.contract import Observation, SuccessModel
from model_zoo.export import export_bundle
from model_zoo.export.graphs import Graphs
from model_zoo.export.parity import ParityReport
from tests.model_zoo.export.made import Made, made_index, write_dataset, write_made


def report(bundle: Path) -> ParityReport:
    return ParityReport.model_validate_json((bundle / PARITY_FILE).read_text())


def contract(bundle: Path) -> BundleContract:
    return BundleContract.model_validate_json((bundle / CONTRACT_FILE).read_text())


@pytest.fixture
def exported_before(quick: Made, monkeypatch: pytest.MonkeyPatch) -> None:
    """The graphs of the quick model are at hand: tracing it is what takes time."""

    def known(model: SuccessModel, temperature: float, example: Observation) -> Graphs:
        encode, score = ((quick.bundle / name).read_bytes() for name in (ENCODE_GRAPH, SCORE_GRAPH))
        features = {tensor.name: (1, 128) for tensor in contract(quick.bundle).features}
        return Graphs(encode, score, features)

    monkeypatch.setattr("model_zoo.export.export.export_graphs", known)


def test_no_candidates_give_no_rows(quick: Made) -> None:
    promise = contract(quick.bundle)
    score = onnxruntime.InferenceSession(str(quick.bundle / SCORE_GRAPH))
    feed = {tensor.name: np.zeros((1, 128), np.float32) for tensor in promise.features}
    (found,) = score.run(None, {**feed, "trajectory_image": np.zeros((0, 240, 320), np.uint8)})
    assert found.shape == (0, 10)


def test_the_same_checkpoint_gives_the_same_bytes_and_replaces_an_older_bundle(
    quick: Made, tmp_path: Path
) -> None:
    again = tmp_path / "again"
    shutil.copytree(quick.bundle, again)
    (again / CARD_FILE).write_text("older")
    export_bundle(quick.checkpoint, again, quick.dataset)
    for name in (ENCODE_GRAPH, SCORE_GRAPH, CONTRACT_FILE, RECORDED_FILE, CARD_FILE):
        assert (again / name).read_bytes() == (quick.bundle / name).read_bytes()
    assert [path.name for path in tmp_path.iterdir()] == ["again"]


def test_the_card_tells(quick: Made) -> None:
    card = (quick.bundle / CARD_FILE).read_text()
    assert "# paad (small)" in card
    assert "| into score | trajectory_image | uint8 | (K, 240, 320)" in card
    assert "cases (adverse, real)" in card
    assert "Not known of it: nothing." in card


@pytest.mark.usefixtures("exported_before")
def test_the_thresholds_of_a_field_go_with_the_bundle(quick: Made, tmp_path: Path) -> None:
    fitted = Thresholds(acceptance=0.8, reliability=0.6)
    bundle = export_bundle(quick.checkpoint, tmp_path / "bundle", thresholds=fitted)
    decision, before = contract(bundle).decision, contract(quick.bundle).decision
    assert (decision.acceptance, decision.reliability) == (0.8, 0.6)
    assert (before.acceptance, before.reliability) == (0.5, 0.4)
    assert decision.step_weights == before.step_weights
    assert "0.8 or more" in (bundle / CARD_FILE).read_text()


@pytest.mark.usefixtures("exported_before")
def test_without_the_dataset_rows_are_drawn(quick: Made, tmp_path: Path) -> None:
    bundle = export_bundle(quick.checkpoint, tmp_path / "bundle")
    assert {case.kind for case in report(bundle).cases} == {"drawn", "adverse"}


@pytest.mark.usefixtures("exported_before")
def test_a_checkpoint_that_does_not_know_its_data_needs_the_dataset(
    quick: Made, tmp_path: Path
) -> None:
    checkpoint = write_made(tmp_path / "old", quick.name, quick.index, told=False)
    with pytest.raises(ZooError, match="Give that dataset with --dataset"):
        export_bundle(checkpoint, tmp_path / "bundle")
    bundle = export_bundle(checkpoint, tmp_path / "bundle", quick.dataset)
    assert contract(bundle).observation == contract(quick.bundle).observation


@pytest.mark.usefixtures("exported_before")
def test_graphs_that_differ_from_the_model_are_never_written(quick: Made, tmp_path: Path) -> None:
    hotter = write_made(tmp_path / "hotter", quick.name, quick.index, calibration=None)
    with pytest.raises(ZooError, match=r"onnxruntime and torch differ by .* No bundle was written"):
        export_bundle(hotter, tmp_path / "bundle", quick.dataset)
    assert not (tmp_path / "bundle").exists()


def test_another_dataset_is_refused(quick: Made, tmp_path: Path) -> None:
    write_dataset(tmp_path / "other", order_seed=5)
    with pytest.raises(ZooError, match="Give the dataset that it was trained on"):
        export_bundle(quick.checkpoint, tmp_path / "bundle", tmp_path / "other")


def test_a_dataset_without_rows_to_try_is_refused(tmp_path: Path) -> None:
    index = write_dataset(tmp_path / "dataset", splits={}, recordings=[])
    checkpoint = write_made(tmp_path / "checkpoint", "paad", index)
    with pytest.raises(ZooError, match="no row in test, validation, train"):
        export_bundle(checkpoint, tmp_path / "bundle", tmp_path / "dataset")


def test_columns_that_no_planner_would_derive_are_refused(quick: Made, tmp_path: Path) -> None:
    columns = tuple(
        column.model_copy(update={"shape": (360,)}) if column.name == "laser_scan" else column
        for column in made_index().columns
    )
    checkpoint = write_made(tmp_path / "odd", quick.name, quick.index, columns=columns)
    with pytest.raises(ZooError, match=r"laser_scan: the model reads float32 \(360,\)"):
        export_bundle(checkpoint, tmp_path / "bundle")


def test_a_control_is_no_model_for_a_robot(quick: Made, tmp_path: Path) -> None:
    recipe = {"augmentation": {"reliability": "shuffled"}}
    checkpoint = write_made(tmp_path / "control", quick.name, quick.index, recipe=recipe)
    with pytest.raises(ZooError, match="taught with shuffled reliabilities, which no robot can"):
        export_bundle(checkpoint, tmp_path / "bundle")


def test_other_files_are_not_overwritten(quick: Made, tmp_path: Path) -> None:
    (tmp_path / "notes.txt").write_text("mine")
    with pytest.raises(ZooError, match=r"holds other files \(notes.txt\)"):
        export_bundle(quick.checkpoint, tmp_path)
    assert (tmp_path / "notes.txt").read_text() == "mine"
    with pytest.raises(ZooError, match="is a file"):
        export_bundle(quick.checkpoint, tmp_path / "notes.txt")


def test_parity_knows_its_cases(quick: Made) -> None:
    parity = report(quick.bundle)
    assert len(parity.cases) == 9
    assert json.loads((quick.bundle / PARITY_FILE).read_text())["versions"].keys() == {
        "torch",
        "onnx",
        "onnxruntime",
    }
