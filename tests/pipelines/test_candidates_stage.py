"""The columns of candidates, from a simulated recording to shards."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from graspe_data.known_outcomes import read_outcomes
from graspe_data.manifest import find_manifest, load_manifest, validate
from graspe_data.progress import Silent
from graspe_data.robot import Robot
from graspe_data.shards import Dataset
from graspe_data.simulation.recorded_truth import CANDIDATES_TOPIC
from graspe_data.simulation.scenario import Scenario
from pipelines.build import build_dataset
from pipelines.dataset_settings import CandidateSettings, DatasetRecipe
from pipelines.executors import Workers
from pipelines.process_recording import RecordingTask, Refusal, process_recording
from pipelines.rederive import rederive_rows
from pipelines.simulate import Simulation, simulate
from tests.pipelines.conftest import RecordingFactory

SCENARIO: dict[str, Any] = {
    "name": "garden",
    "duration_s": 6.0,
    "world": {
        "length": 12.0,
        "width": 10.0,
        "ground": {"amplitude": 0.0, "cell": 1.0},
        "features": [{"kind": "pillar", "at": [[2.1, 0.5], [2.0, -0.7], [-3.0, -2.0]]}],
    },
    "camera": {"width": 80, "height": 60, "rate": 2.0},
    "lidar": {"rate": 2.0, "sub_rays": 1},
}
DATASET: dict[str, Any] = {
    "name": "garden",
    "robot": "spot",
    "window": {"history_steps": 5},
    "image": {"width": 80, "height": 60},
    "points": {"sample": {"count": 256}},
    "split": {"train": 1, "validation": 0, "test": 0},
    "candidates": {"count": 5},
}


@pytest.fixture(scope="module")
def spot() -> Robot:
    return load_manifest(find_manifest("robots", "spot"), Robot)


@pytest.fixture(scope="module")
def garden(spot: Robot, tmp_path_factory: pytest.TempPathFactory) -> Path:
    request = Simulation(Scenario.model_validate(SCENARIO), spot, 2, "mcap")
    out = tmp_path_factory.mktemp("garden")
    return simulate([request], out, Workers(1), Silent())[0].path


def asking(spot: Robot, **changes: Any) -> DatasetRecipe:
    return validate({"dataset": DATASET | changes, "robot": spot}, DatasetRecipe, "a test")


def test_rows_hold_the_candidates_of_their_moment_drawn_and_judged(
    garden: Path, spot: Robot, tmp_path: Path
) -> None:
    folder = tmp_path / "dataset"
    build_dataset(asking(spot), [garden], folder, Workers(), Silent())
    dataset = Dataset(folder, "train")
    rows, known = dataset.batch(np.arange(len(dataset))), read_outcomes(garden, CANDIDATES_TOPIC)
    moment = np.searchsorted(known.stamps_ns, rows["stamp_ns"])
    assert len(dataset) > 4
    assert rows["candidate_mask"].all()
    np.testing.assert_array_equal(rows["candidate_success"], known.success[moment, :5])
    assert 0 < rows["candidate_success"].mean() < 1
    expected = known.velocities[moment, :5].astype(np.float32)
    np.testing.assert_array_equal(rows["candidate_velocity"], expected)
    assert rows["candidate_image"].shape[1:] == (5, 60, 80)
    assert rederive_rows(folder, [garden], 3, 0).faults == ()


def test_a_row_knows_its_state_and_a_recording_its_world(
    garden: Path, spot: Robot, tmp_path: Path
) -> None:
    folder = tmp_path / "dataset"
    build_dataset(asking(spot), [garden], folder, Workers(), Silent())
    dataset = Dataset(folder, "train")
    assert dataset.index.recordings[0].details["world"] == "garden, seed 2"
    rows = dataset.batch(np.arange(len(dataset)))
    speed, turning = np.abs(rows["velocity_history"][:, -1]).T
    failing, standing = rows["state"] == 0, rows["state"] == 1
    np.testing.assert_array_equal(standing, ~failing & (speed < 0.05) & (turning < 0.1))
    assert not rows["success"][failing].any()
    assert (rows["state"] == 3).any()


def test_a_candidate_is_drawn_as_a_driven_trajectory_of_its_velocity(
    garden: Path, spot: Robot, tmp_path: Path
) -> None:
    folder = tmp_path / "dataset"
    build_dataset(asking(spot), [garden], folder, Workers(), Silent())
    dataset = Dataset(folder, "train")
    rows = dataset.batch(np.arange(len(dataset)))
    covered = rows["candidate_image"].reshape(len(dataset), 5, -1).sum(axis=2)
    linear, turning = np.moveaxis(rows["candidate_velocity"].astype(np.float64), 2, 0)
    fastest = linear > 0.5
    assert covered[fastest].min() > covered[linear < 0.3].max()
    columns = np.arange(80) - 39.5
    with np.errstate(invalid="ignore"):
        middle = (rows["candidate_image"].sum(axis=2) * columns).sum(axis=2) / covered
    seen = (linear > 0.35) & (np.abs(turning) > 0.15) & (covered > 0)
    assert seen.sum() > 3
    assert np.corrcoef(middle[seen], turning[seen])[0, 1] < -0.8


def test_without_candidates_nothing_of_them_is_stored_nor_decides_a_digest(
    garden: Path, spot: Robot, tmp_path: Path
) -> None:
    folder = tmp_path / "dataset"
    build_dataset(asking(spot, candidates=None), [garden], folder, Workers(), Silent())
    index = Dataset(folder, "train").index
    assert not [column for column in index.columns if column.name.startswith("candidate")]
    assert "candidates" not in index.configuration["dataset"]  # type: ignore[operator]


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"candidates": {"count": 9}}, r"knows of 8 candidates.*lower it to 8"),
        ({"horizon": {"steps": 4}}, r"judges 10 steps of 0.3 s, the dataset's horizon is 4"),
        ({"candidates": {"topic": "/truth/events"}}, "does not hold what a simulation writes"),
    ],
)
def test_what_does_not_fit_the_manifest_is_refused(
    changes: dict[str, Any], message: str, garden: Path, spot: Robot, tmp_path: Path
) -> None:
    refused = process_recording(RecordingTask(garden, asking(spot, **changes), tmp_path))
    assert isinstance(refused, Refusal)
    assert re.search(message, refused.reason), refused.reason


def test_a_recording_that_does_not_know_is_refused_with_the_way_out(
    record: RecordingFactory, recipe: DatasetRecipe, tmp_path: Path
) -> None:
    asks = recipe.dataset.model_copy(update={"candidates": CandidateSettings(topic="/other")})
    task = RecordingTask(record(), recipe.model_copy(update={"dataset": asks}), tmp_path)
    refused = process_recording(task)
    assert isinstance(refused, Refusal)
    assert "no topic /other" in refused.reason
    assert "Leave `candidates` out" in refused.reason
