"""``graspe intensity``: pictures, a video, and what is refused."""

from __future__ import annotations

import json
from itertools import pairwise
from pathlib import Path

import cv2
import numpy as np
import pytest
from typer.testing import CliRunner

from graspe_data.errors import StageError
from graspe_data.progress import Silent
from graspe_data.recordings import open_recording
from graspe_data.synchronisation.synchronised import synchronise
from pipelines.command_line import app
from pipelines.dataset_settings import DatasetRecipe, load_recipe
from pipelines.intensity.mapped_clouds import CloudMapper, MappedCloud, MapRequest
from pipelines.intensity.render_recording import render_recording
from tests.pipelines.conftest import RecordingFactory

STREET = "kitti_street_camera_lidar_odometry"


def test_draws_a_picture_a_cloud_and_a_video(record: RecordingFactory, tmp_path: Path) -> None:
    arguments = ["intensity", str(record()), "--out", str(tmp_path / "maps"), "--json"]
    options = ["--every", "9", "--goal", "5", "1", "--glass", "--inflation", "uniform"]
    result = CliRunner().invoke(app, arguments + options)
    assert result.exit_code == 0, result.output
    found = json.loads(result.stdout)
    pictures = [cv2.imread(path) for path in found["pictures"]]
    assert {picture.shape for picture in pictures if picture is not None} == {(640, 1600, 3)}
    assert len(pictures) > 2
    assert found["lost"] == {}
    if found["video"] is not None:
        assert cv2.VideoCapture(found["video"]).get(cv2.CAP_PROP_FRAME_COUNT) == len(pictures)
    assert not list((tmp_path / "maps").glob(".*"))


def test_a_goal_without_direction_is_refused(record: RecordingFactory, tmp_path: Path) -> None:
    arguments = ["intensity", str(record()), "--out", str(tmp_path), "--goal", "0", "0"]
    result = CliRunner().invoke(app, arguments)
    assert isinstance(result.exception, StageError)


def test_a_recording_on_another_scale_is_refused_with_the_key_to_set(
    record: RecordingFactory, recipe: DatasetRecipe, tmp_path: Path
) -> None:
    lidar = recipe.robot.lidar.model_copy(update={"intensity_maximum": 1.0})
    wrong = recipe.model_copy(update={"robot": recipe.robot.model_copy(update={"lidar": lidar})})
    with pytest.raises(StageError, match=r"no cloud gives a map.*lidar\.intensity_maximum"):
        render_recording(record(), wrong, MapRequest(every=10), tmp_path, Silent())


def test_on_a_street_the_lane_is_free_up_to_the_car_ahead_and_vehicles_are_solid(
    recordings: Path,
) -> None:
    recipe = load_recipe("kitti_street")
    dataset = recipe.dataset
    ends = []
    with open_recording(recordings / STREET) as recording:
        synchronised = synchronise(recording, recipe.robot, dataset.clocks, dataset.synchronisation)
        request = MapRequest.model_validate({"planning": {"glass": None}, "every": 6})
        for mapped in CloudMapper(recording, synchronised, recipe, request):
            assert isinstance(mapped, MappedCloud)
            classes = mapped.planned.classes
            # Two metres wide, from the bumper on; the car ahead stands 8 to 4 m from base_link.
            lane = np.s_[:88, 95:105]
            first = int(np.flatnonzero(~classes.free[lane].all(axis=1)).max())
            ends.append(20 - 0.2 * (first + 1))
            assert (classes.true_positive[first - 1 : first + 1, 95:105] > 0).sum() >= 4
            lorry = np.s_[:100, 110:130]
            solid = int((classes.true_positive[lorry] > 0).sum())
            pliable = int((classes.false_positive[lorry] > 0).sum())
            assert solid > 2 * pliable
            assert solid > 100
            beside = np.s_[45:85, 76:92]  # The queue of the left lane: a car, then a red lorry.
            solid = int((classes.true_positive[beside] > 0).sum())
            assert solid > 2 * int((classes.false_positive[beside] > 0).sum())
            assert solid > 20
    assert ends[0] == pytest.approx(7.8, abs=0.3)
    assert ends[-1] == pytest.approx(4.2, abs=0.3)
    assert all(later <= earlier + 0.2 for earlier, later in pairwise(ends))
