from __future__ import annotations

from typing import Any

import pytest

from graspe_data.errors import ZooError
from model_zoo.checkpoints import load_checkpoint
from model_zoo.checkpoints.assumptions import read_assumptions
from tests.model_zoo.export.made import DETAILS, configuration, made_index, write_made


def index_of(*details: dict[str, Any], **changes: Any) -> Any:
    index = made_index(*details, **changes)
    entries = [entry.model_copy(update={"rows": 3}) for entry in index.recordings]
    return index.model_copy(update={"recordings": entries})


def test_what_the_configuration_says_is_read() -> None:
    found = read_assumptions(index_of(DETAILS, DETAILS))
    assert found is not None
    assert found.observation.picture_size == (240, 320)
    assert found.observation.history_steps == 50
    assert found.observation.points.base_height == found.robot.base_height == 0.5
    assert found.observation.points.rings == 16
    assert found.observation.points.laser_scan.minimum_height == 0.15
    assert found.robot.limits.yaw_rate == (-0.6, 0.6)
    assert found.robot.unknown == {}
    assert found.robot.base_from_camera is not None
    assert found.robot.base_from_camera.rotation[0] == (0.0, 0.0, 1.0)
    assert found.robot.base_from_camera.translation == (0.3, 0.0, 0.1)


def test_a_mounting_of_the_manifest_counts_before_that_of_recordings() -> None:
    described = configuration()
    described["robot"]["lidar"]["mounting"] = {"translation": [0.1, 0.2, 0.3]}
    found = read_assumptions(index_of(DETAILS, configuration=described))
    assert found is not None
    assert found.robot.base_from_lidar is not None
    assert found.robot.base_from_lidar.translation == (0.1, 0.2, 0.3)
    assert found.robot.base_from_lidar.rotation == ((1, 0, 0), (0, 1, 0), (0, 0, 1))


def test_what_recordings_do_not_tell_or_tell_differently_is_unknown() -> None:
    camera = dict(DETAILS, camera=None, base_from_camera=None)
    other = dict(camera, base_from_lidar=[[1.0] * 9, [0.0, 0.0, 0.4]])
    found = read_assumptions(index_of(camera, other))
    assert found is not None
    assert found.robot.camera is None
    assert found.robot.base_from_lidar is None
    assert found.robot.unknown == {
        "camera": "the dataset does not tell",
        "base_from_camera": "the dataset does not tell",
        "base_from_lidar": "its recordings differ",
    }


def test_a_dataset_that_no_pipeline_made_tells_nothing() -> None:
    assert read_assumptions(index_of(configuration={})) is None


def test_a_damaged_configuration_is_refused() -> None:
    described = configuration()
    del described["dataset"]["horizon"]
    with pytest.raises(ZooError, match=r"horizon: missing\.\nBuild the dataset"):
        read_assumptions(index_of(configuration=described))


def test_a_checkpoint_keeps_them(tmp_path: Any) -> None:
    index = index_of(DETAILS).model_copy(update={"dataset_digest": "b" * 64})
    described = load_checkpoint(write_made(tmp_path / "told", "nmfnet", index))
    assert described.config.assumptions == read_assumptions(index)
    old = load_checkpoint(write_made(tmp_path / "old", "nmfnet", index, told=False))
    assert old.config.assumptions is None
