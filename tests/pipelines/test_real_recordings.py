"""The main job on the real recording with all three sensors."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from graspe_data.progress import Silent
from graspe_data.shards import Dataset
from pipelines.build import BuildResult, build_dataset
from pipelines.dataset_settings import load_recipe
from pipelines.executors import Workers
from pipelines.process_recording import RecordingTask, Refusal, process_recording
from pipelines.rederive import rederive_rows

STREET = "kitti_street_camera_lidar_odometry"


@pytest.fixture(scope="module")
def street(recordings: Path, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, BuildResult]:
    out = tmp_path_factory.mktemp("street") / "dataset"
    recipe = load_recipe("kitti_street")
    return out, build_dataset(recipe, [recordings / STREET], out, Workers(), Silent())


@pytest.fixture(scope="module")
def rows(street: tuple[Path, BuildResult]) -> dict[str, NDArray[np.generic]]:
    dataset = Dataset(street[0], "train")
    batch = dataset.batch(np.arange(len(dataset)))
    order = np.argsort(batch["stamp_ns"])
    return {name: values[order] for name, values in batch.items()}


def test_every_anchor_of_the_seconds_that_remain_is_a_row(
    street: tuple[Path, BuildResult], rows: dict[str, NDArray[np.generic]]
) -> None:
    assert street[1].index.losses == {
        "history begins before the odometry": 25,
        "horizon runs past the end of the odometry": 10,
    }
    steps = np.diff(rows["stamp_ns"].astype(np.int64))
    assert len(steps) == 42
    assert (steps == 100_000_000).all()


def test_every_second_cloud_is_a_tenth_of_a_second_old(
    rows: dict[str, NDArray[np.generic]],
) -> None:
    ages, counts = np.unique(rows["points_age_ns"].astype(np.int64), return_counts=True)
    assert ages.tolist() == [0, 100_000_000]
    assert counts.tolist() == [21, 22]
    assert not rows["odometry_age_ns"].any()


def test_the_car_rolls_to_a_stop(rows: dict[str, NDArray[np.generic]]) -> None:
    speed = rows["velocity_history"].astype(np.float64)[:, -1, 0]
    assert speed[0] == pytest.approx(1.75, abs=0.01)
    assert np.abs(speed[-8:]).max() < 0.1
    pose = rows["pose"].astype(np.float64)
    assert pose[-1, 0] - pose[0, 0] == pytest.approx(2.41, abs=0.05)


def test_a_street_is_structured_and_nothing_failed(
    rows: dict[str, NDArray[np.generic]],
) -> None:
    planar = rows["r_planar"].astype(np.float64)
    assert 0.70 < planar.min() < planar.max() < 0.90
    mask = rows["success_mask"].astype(bool)
    assert rows["success"][mask].all()
    assert mask.mean() > 0.99


def test_the_rows_are_proved_against_the_recording(
    recordings: Path, street: tuple[Path, BuildResult]
) -> None:
    result = rederive_rows(street[0], [recordings / STREET], count=5, seed=1)
    assert (result.rows, result.faults) == (5, ())


def test_a_recording_without_a_camera_is_refused_with_the_topics_it_has(
    recordings: Path, tmp_path: Path
) -> None:
    recipe = load_recipe("kitti_street")
    path = recordings / "embag_luminar_scan_odom_lz4.bag"
    refusal = process_recording(RecordingTask(path, recipe, tmp_path))
    assert isinstance(refusal, Refusal)
    assert "lacks the topics of the robot manifest" in refusal.reason
    assert "/odom" in refusal.reason
