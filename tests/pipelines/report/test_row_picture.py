"""One row as a picture."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from graspe_data.shards.dataset import Dataset
from pipelines.report import page, row_scene, write_report
from pipelines.report.row_picture import draw_row, write_row_picture
from tests.pipelines.report.conftest import parsed, write_dataset


def scene_of(dataset: Path, **changes: Any) -> row_scene.RowScene:
    opened = Dataset(dataset, "train", row_scene.SCENE_COLUMNS)
    return row_scene.row_scene(opened.index, opened.row(0) | changes)


def test_an_arc_outside_the_picture_is_continued_to_fifteen_metres(dataset: Path) -> None:
    scene = scene_of(dataset)
    assert scene.arc[-1, 0] == pytest.approx(3.0)
    assert scene.ahead[0, 0] == pytest.approx(3.0, abs=0.1)
    assert scene.ahead[-1, 0] == pytest.approx(15.0)
    assert scene.continued_to == pytest.approx(15.0)
    rows, columns = np.nonzero(scene.ribbon_ahead)
    assert rows.min() == pytest.approx(23.5 + 40 / 15, abs=1.0)
    assert rows.max() == pytest.approx(23.5 + 40 / 3, abs=1.0)
    assert columns.mean() == pytest.approx(31.5, abs=0.5)


def test_an_arc_in_the_picture_is_not_continued(dataset: Path) -> None:
    scene = scene_of(dataset, trajectory_image=np.ones((48, 64), np.uint8))
    assert scene.picture_shows_arc
    assert len(scene.ahead) == 0
    assert not scene.ribbon_ahead.any()


def test_the_continuation_fades_at_the_first_obstacle(dataset: Path) -> None:
    scan = np.full(31, np.inf, np.float32)
    scan[15] = 6.0
    scene = scene_of(dataset, laser_scan=scan)
    assert scene.ribbon_ahead.any()
    assert scene.ribbon_beyond.any()
    masks = (scene.ribbon_ahead, scene.ribbon_beyond)
    nearer, farther = (np.flatnonzero(mask.any(axis=1)) for mask in masks)
    assert nearer.max() > farther.max()
    assert farther.max() == pytest.approx(23.5 + 40 / 6, abs=1.0)


def test_an_arc_drawn_from_behind_is_shown_where_the_camera_sees_it(dataset: Path) -> None:
    opened = Dataset(dataset, "train", row_scene.SCENE_COLUMNS)
    configuration: dict[str, Any] = dict(opened.index.configuration)
    configuration["dataset"] = {**configuration["dataset"], "trajectory_image": {"behind": 1.0}}
    index = opened.index.model_copy(update={"configuration": configuration})
    drawn = np.ones((48, 64), np.uint8)
    scene = row_scene.row_scene(index, opened.row(0) | {"trajectory_image": drawn})
    rows, columns = np.nonzero(scene.ribbon)
    assert rows.min() == pytest.approx(23.5 + 40 / 3, abs=1.0)
    assert rows.max() == 47
    assert columns.mean() == pytest.approx(31.5, abs=0.5)
    assert len(scene.ahead) == 0


@pytest.mark.parametrize("velocity", [(0.0, 0.5), (-1.0, 0.0), (1.0, 2.0), (0.0, 0.0)])
def test_any_velocity_can_be_drawn(dataset: Path, velocity: tuple[float, float]) -> None:
    history = np.tile(np.array(velocity, np.float32), (8, 1))
    scene = scene_of(dataset, velocity_history=history)
    assert np.isfinite(scene.ahead).all()
    assert _size(draw_row(scene, "a row", dpi=50)) == (250, 680)


def test_without_points_or_calibration_a_row_can_be_drawn(tmp_path: Path) -> None:
    folder = write_dataset(tmp_path, details={"camera": None, "base_from_camera": None})
    scene = scene_of(folder, points=np.full((50, 3), np.nan, np.float32))
    assert not scene.ribbon_ahead.any()
    assert _size(draw_row(scene, "a row", dpi=50)) == (250, 680)


def test_a_row_tells_its_time_in_the_recording(tmp_path: Path) -> None:
    folder = write_dataset(tmp_path / "timed", details={"time_zero_ns": -4_720_000_000})
    scene = scene_of(folder)
    assert scene.time_s == pytest.approx(4.72)
    untimed = dataclasses.replace(scene, time_s=None)
    assert draw_row(scene, "a row", dpi=50) != draw_row(untimed, "a row", dpi=50)
    write_report(folder, tmp_path / "page.html")
    words = " ".join(parsed(tmp_path / "page.html").texts)
    assert "train row 0, t = 4.7 s, stamp 0 ns." in words
    assert "validation row 0, stamp" in words


@pytest.mark.parametrize(
    ("aspect", "note"), [(0.4, "squeezed to 40 %"), (1.5, "stretched to 150 %"), (1.0, "")]
)
def test_a_picture_of_another_aspect_is_said_to_be(dataset: Path, aspect: float, note: str) -> None:
    scene = dataclasses.replace(scene_of(dataset), pixel_aspect=aspect)
    found = page._caption(scene, "train", 0).partition("ns.")[2]
    assert found == (f" As stored, the picture is {note} of its width." if note else "")


def test_a_row_is_written_as_a_picture(dataset: Path, tmp_path: Path) -> None:
    write_row_picture(dataset, "train", 3, tmp_path / "row.png", dpi=50)
    assert _size((tmp_path / "row.png").read_bytes()) == (250, 680)


def _size(png: bytes) -> tuple[int, int]:
    decoded = cv2.imdecode(np.frombuffer(png, np.uint8), cv2.IMREAD_COLOR)
    assert decoded is not None
    height, width = decoded.shape[:2]
    return height, width
