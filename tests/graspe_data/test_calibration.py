"""Where sensors sit: by the manifest's numbers, or as a recording told."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from graspe_data.calibration import calibration_of, declared_mounting, restored, stored
from graspe_data.errors import ManifestError, PlannerError
from graspe_data.geometry import Transform, rotation_from_rpy
from graspe_data.robot import Intrinsics, Mounting, Robot, load_robot
from graspe_data.shards.dataset_index import RecordingEntry

AHEAD = Mounting(translation=(0.1, 0.2, 0.3))
LENS = Intrinsics(width=64, height=48, fx=45.0, fy=45.0, cx=31.5, cy=23.5)


@pytest.fixture
def robot() -> Robot:
    """Its camera and lidar sit where recordings say."""
    return load_robot("spot")


def test_the_numbers_of_the_manifest_are_declared_and_tf_is_not(robot: Robot) -> None:
    assert declared_mounting(robot, "camera") is None
    assert declared_mounting(robot, "lidar") is None
    lidar = robot.lidar.model_copy(update={"mounting": AHEAD})
    found = declared_mounting(robot.model_copy(update={"lidar": lidar}), "lidar")
    assert found is not None
    assert found.translation.tolist() == [0.1, 0.2, 0.3]


def test_a_calibration_has_to_be_in_numbers(robot: Robot) -> None:
    with pytest.raises(PlannerError, match=r"camera\.intrinsics is left to 'camera_info'"):
        calibration_of(robot)
    camera = robot.camera.model_copy(update={"intrinsics": LENS, "mounting": AHEAD})
    seeing = robot.model_copy(update={"camera": camera})
    with pytest.raises(PlannerError, match=r"lidar\.mounting is left to 'tf'"):
        calibration_of(seeing)
    lidar = robot.lidar.model_copy(update={"mounting": AHEAD})
    found = calibration_of(seeing.model_copy(update={"lidar": lidar}))
    assert found.base_from_lidar.translation.tolist() == [0.1, 0.2, 0.3]


def test_a_transform_is_kept_to_the_bit() -> None:
    transform = Transform(rotation_from_rpy(0.1, -0.2, 3.0), np.array([0.1, 0.2, -0.3]))
    found = restored(stored(transform))
    assert np.array_equal(found.rotation, transform.rotation)
    assert np.array_equal(found.translation, transform.translation)


def entry(**details: Any) -> RecordingEntry:
    return RecordingEntry(name="drive", digest="", group="", details=details)


def test_an_entry_tells_its_calibration_and_an_old_one_that_there_is_none() -> None:
    kept = [[1.0, 0, 0, 0, 1, 0, 0, 0, 1], [0.1, 0.2, 0.3]]
    told = entry(camera=LENS.model_dump(mode="json"), base_from_camera=kept, content=None)
    mounting = told.calibration.mounting("camera")
    assert told.calibration.camera == LENS
    assert mounting is not None
    assert mounting.translation.tolist() == [0.1, 0.2, 0.3]
    assert told.calibration.mounting("lidar") is None
    assert entry(time_zero_ns=3).calibration.camera is None


@pytest.mark.parametrize("kept", ["front", [[1.0] * 8, [0.0] * 3], [[1.0] * 9]])
def test_a_damaged_calibration_is_refused_by_name(kept: Any) -> None:
    with pytest.raises(ManifestError, match=r"drive: calibration in dataset\.json"):
        _ = entry(base_from_lidar=kept).calibration
