from __future__ import annotations

import dataclasses
import re
from collections.abc import Mapping
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from graspe_data.errors import ShardError
from graspe_data.robot import Footprint, Limits, Robot, Topics
from graspe_data.shards.dataset import Dataset
from graspe_data.shards.dataset_manifest import (
    DatasetIndex,
    RecordingEntry,
    read_index,
    write_index,
)
from graspe_data.shards.shard_writer import write_shard
from pipelines.dataset_settings import DatasetManifest, DatasetRecipe
from pipelines.report import balance, histograms, notices, page, row_scene, samples, write_report
from pipelines.report.row_picture import draw_row, write_row_picture
from pipelines.row_columns import row_columns

HOSTILE = "<script>alert('$\\frac{')</script>&\u6f22.bag"
REASON = "a <b>reason</b>"
VOID = {"meta", "img", "br", "path", "use", "rect", "line"}

Rows = dict[str, NDArray[Any]]


class Page(HTMLParser):
    """Checks that elements nest, and collects text, elements and attributes."""

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.elements: list[str] = []
        self.attributes: list[tuple[str, str]] = []
        self.texts: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.elements.append(tag)
        self.attributes += [(name, value or "") for name, value in attrs]
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        if tag not in VOID:
            assert self.open.pop() == tag

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.elements.append(tag)
        self.attributes += [(name, value or "") for name, value in attrs]

    def handle_data(self, data: str) -> None:
        self.texts.append(data)


def parsed(path: Path) -> Page:
    found = Page()
    found.feed(path.read_text(encoding="utf-8"))
    found.close()
    assert found.open == []
    return found


def manifest() -> DatasetManifest:
    return DatasetManifest.model_validate(
        {
            "name": "tiny",
            "robot": "cart",
            "image": {"width": 64, "height": 48},
            "points": {"sample": {"count": 50}, "laser_scan": {"rays": 30}},
            "window": {"history_steps": 8},
        }
    )


def robot() -> Robot:
    return Robot(
        name="cart",
        topics=Topics(image="/image", points="/points", odometry="/odom"),
        limits=Limits(linear_velocity=(0, 2), yaw_rate=(-1, 1)),
        footprint=Footprint(length=1.0, width=0.6),
    )


def recipe() -> DatasetRecipe:
    return DatasetRecipe(dataset=manifest(), robot=robot())


def stored_rows(count: int, recording: int, failing: int, speed: float = 1.0) -> Rows:
    """So many rows, of which the first ones fail from their sixth step on."""
    draw = np.random.default_rng(recording)
    rows: Rows = {
        column.name: np.zeros((count, *column.stored_shape), column.dtype)
        for column in row_columns(recipe())
    }
    rows["image"] = draw.integers(0, 256, rows["image"].shape, np.uint8)
    rows["points"] = draw.uniform(0, 10, rows["points"].shape).astype(np.float32)
    rows["points"][:, 40:] = np.nan
    rows["intensity"][:, 40:] = np.nan
    rows["laser_scan"][:] = np.inf
    rows["velocity_history"][..., 0] = speed
    rows["success"][:] = 1
    rows["success"][:failing, 5:] = 0
    rows["success_mask"][:] = True
    rows["success_mask"][-1] = False
    rows["label_source"][:] = rows["success_mask"]
    rows["recording"][:] = recording
    rows["stamp_ns"] = np.arange(count) * 10**8
    rows["points_age_ns"] = np.arange(count) * 10**7
    for name in ("r_bright", "r_corners", "r_img", "r_edge", "r_planar", "r_point"):
        rows[name] = draw.random(count).astype(np.float32)
    for name in ("image_valid", "points_valid", "odometry_valid"):
        rows[name][:] = True
    return rows


def camera() -> dict[str, Any]:
    """A camera 1 m above the ground that looks ahead."""
    return {
        "camera": {"width": 64, "height": 48, "fx": 40, "fy": 40, "cx": 31.5, "cy": 23.5},
        "base_from_camera": [[0, 0, 1, -1, 0, 0, 0, -1, 0], [0, 0, 1]],
    }


def write_dataset(folder: Path, failing: int = 3, details: Mapping[str, Any] | None = None) -> Path:
    """Two recordings in train and validation, one that was refused, and an empty test split."""
    columns = row_columns(recipe())
    counts = {"train": (0, 12, failing), "validation": (1, 5, 0)}
    shards = {
        split: [write_shard(folder, f"shards/{split}.npz", columns, stored_rows(rows, number, bad))]
        for split, (number, rows, bad) in counts.items()
    }
    entries = [
        RecordingEntry(
            name=HOSTILE,
            digest="ab" * 32,
            group="monday",
            split="train",
            rows=12,
            losses={REASON: 1234},
            details=camera()
            | {
                "offsets_ns": {"/points": 2_500_000_000, "/image": 0},
                "damage": [{"reason": "cut", "topic": "/t", "messages": 3, "seconds": 0.25}],
                "events": {"taken": 2, "added": 0},
                "not_judged": {"stuck": "no commands"},
            }
            | dict(details or {}),
        ),
        RecordingEntry(name="b", digest="cd" * 32, group="b", split="validation", rows=5),
        RecordingEntry(name="c", digest="", group="c", details={"refused": "not a recording"}),
    ]
    index = DatasetIndex(
        name="tiny",
        columns=tuple(columns),
        group_key="day",
        splits=shards | {"test": []},
        recordings=entries,
        losses={REASON: 1234},
        configuration={
            "dataset": manifest().model_dump(mode="json", exclude={"storage"}),
            "robot": robot().model_dump(mode="json"),
        },
    )
    write_index(folder, index)
    return folder


@pytest.fixture(scope="module")
def dataset(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_dataset(tmp_path_factory.mktemp("tiny"))


@pytest.fixture(scope="module")
def report(dataset: Path) -> Path:
    path = dataset / "report.html"
    write_report(dataset, path)
    return path


def test_the_page_nests_and_holds_the_numbers_of_the_dataset(dataset: Path, report: Path) -> None:
    text = " ".join(parsed(report).texts)
    words = re.sub(r"\s+", " ", text)
    assert read_index(dataset).dataset_digest in words
    for expected in (
        "1,234",
        "damaged: cut (/t, 3 messages, 0.2 s)",
        "clock of /points moved by +2.500 s",
        "2 taken",
        "stuck not judged: no commands",
        "not a recording",
        "The split test has no rows.",
        "1 of 3 recordings were refused.",
        "110 of 120",
        "The trajectory image is empty in 12 of 12 rows of train: the arc ends before",
    ):
        assert expected in words
    assert "clock of /image" not in words


def test_names_of_strangers_stay_text(report: Path) -> None:
    page = parsed(report)
    assert "script" not in page.elements
    assert any(HOSTILE in text for text in page.texts)
    assert any(REASON in text for text in page.texts)


def test_the_page_needs_nothing_from_elsewhere(report: Path) -> None:
    text = report.read_text(encoding="utf-8")
    assert "://" not in text
    for name, value in parsed(report).attributes:
        if name in {"src", "href"}:
            assert value.startswith(("data:image/png;base64,", "#"))
    assert re.findall(r"url\((?!#)", text) == []


def test_ids_are_unique_and_references_meet_them(report: Path) -> None:
    attributes = parsed(report).attributes
    ids = [value for name, value in attributes if name == "id"]
    assert len(ids) == len(set(ids))
    assert {value[1:] for name, value in attributes if name == "href"} <= set(ids)


def test_the_same_dataset_gives_the_same_page(dataset: Path, report: Path, tmp_path: Path) -> None:
    write_report(dataset, tmp_path / "again.html")
    assert (tmp_path / "again.html").read_bytes() == report.read_bytes()


def test_without_failures_the_page_says_so(tmp_path: Path) -> None:
    folder = write_dataset(tmp_path / "d", failing=0)
    write_report(folder, tmp_path / "page.html")
    assert any("No row fails" in text for text in parsed(tmp_path / "page.html").texts)


def notices_of(folder: Path, rows: Rows) -> list[str]:
    """What a dataset of these rows, all in train, has to tell."""
    columns = row_columns(recipe())
    shard = write_shard(folder, "shards/train.npz", columns, rows)
    entry = RecordingEntry(name="a", digest="ab" * 32, group="a", split="train", rows=8)
    written = DatasetIndex(
        name="tiny",
        columns=tuple(columns),
        group_key="day",
        splits={"train": [shard]},
        recordings=[entry],
    )
    index = write_index(folder, written)
    return notices.notices(folder, index, {"train": balance.split_balance(folder, index, "train")})


@pytest.mark.parametrize(("shown", "told"), [(5, True), (6, True), (7, False)])
def test_empty_trajectory_images_are_told_from_a_quarter_on(
    tmp_path: Path, shown: int, *, told: bool
) -> None:
    rows = stored_rows(8, 0, failing=1)
    rows["trajectory_image"][:shown, -1, -1] = 1
    expected = (
        f"The trajectory image is empty in {8 - shown} of 8 rows of train: the arc ends before "
        "the picture's ground begins, or runs beside it. Lengthen the horizon, drive faster, or "
        "draw it as from behind the camera: `trajectory_image: {behind: 1.0}` in the dataset's "
        "manifest."
    )
    assert notices_of(tmp_path, rows) == ([expected] if told else [])


def test_where_the_robot_stands_no_longer_horizon_is_advised(tmp_path: Path) -> None:
    found = notices_of(tmp_path, stored_rows(8, 0, failing=1, speed=0.0))
    empty = "The trajectory image is empty in 8 of 8 rows of train"
    assert found == [f"{empty}; in 8 of them the robot stands."]


def test_a_split_without_rows_has_no_bar(report: Path) -> None:
    text = report.read_text(encoding="utf-8")
    rows = [row for row in text.split("<tr") if "<td>test</td>" in row]
    assert "no rows" in rows[0]
    assert 'class="bar"' not in rows[0]


def test_a_folder_without_dataset_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(ShardError, match="no finished dataset"):
        write_report(tmp_path, tmp_path / "page.html")


def test_balance_counts_rows_and_steps(dataset: Path) -> None:
    found = balance.split_balance(dataset, read_index(dataset), "train")
    assert found.whole == balance.Balance(
        rows=12,
        rows_failing=3,
        rows_unjudged=1,
        steps=120,
        steps_failing=15,
        steps_succeeding=95,
    )
    assert found.recordings == {0: found.whole}
    assert found.valid == {"image_valid": 12, "points_valid": 12, "odometry_valid": 12}


def test_histograms_count_every_row_once(dataset: Path) -> None:
    quantities = (
        histograms.Quantity("r_img", "", limits=(0, 1)),
        histograms.Quantity("points_age_ns", "", unit=1e6),
        histograms.Quantity("odometry_age_ns", "", unit=1e6),
    )
    for made in histograms.histograms(dataset, ("train", "validation"), quantities):
        assert made.counts["train"].sum() == 12
        assert made.counts["validation"].sum() == 5
    ages = histograms.histograms(dataset, ("train",), quantities)[1]
    assert (ages.edges[0], ages.edges[-1]) == (0, 110)


@pytest.mark.parametrize(("age_ms", "ends"), [(0.0, (-1, 1)), (0.3, (-1, 2)), (30.0, (28.5, 31.5))])
def test_ages_that_are_all_one_lie_inside_a_readable_axis(
    tmp_path: Path, age_ms: float, ends: tuple[float, float]
) -> None:
    rows = stored_rows(8, 0, failing=1) | {"odometry_age_ns": np.full(8, round(age_ms * 1e6))}
    notices_of(tmp_path, rows)
    age = histograms.Quantity("odometry_age_ns", "", unit=1e6, room=1)
    (made,) = histograms.histograms(tmp_path, ("train",), (age,))
    assert (made.edges[0], made.edges[-1]) == pytest.approx(ends)
    occupied = int(made.counts["train"].argmax())
    assert made.counts["train"][occupied] == 8
    assert made.edges[occupied] <= age_ms <= made.edges[occupied + 1]


def test_samples_show_failures_and_the_least_reliable_and_no_row_twice(dataset: Path) -> None:
    groups = samples.choose_samples(dataset, ("train", "validation"))
    failing, succeeding, picture, _ = (group.rows for group in groups)
    assert [(c.split, c.row) for c in failing] == [("train", 0), ("train", 1), ("train", 2)]
    assert [c.split for c in succeeding] == ["train", "train", "validation", "validation"]
    assert picture[0].rank < picture[1].rank
    shown = [(c.split, c.row) for group in groups for c in group.rows]
    assert len(shown) == len(set(shown))


def test_failures_are_shown_of_every_recording_and_from_before_they_begin(tmp_path: Path) -> None:
    rows = stored_rows(40, 0, failing=0)
    rows["recording"][20:] = 1
    rows["success_mask"][:] = True
    begins = np.tile(np.repeat([9, 5, 2, 0], 5), 2)
    rows["success"] = (np.arange(10) < begins[:, None]).astype(rows["success"].dtype)
    columns = row_columns(recipe())
    shard = write_shard(tmp_path, "shards/train.npz", columns, rows)
    entries = [
        RecordingEntry(name=name, digest=name * 64, group=name, split="train", rows=20)
        for name in "ab"
    ]
    written = DatasetIndex(
        name="tiny",
        columns=tuple(columns),
        group_key="day",
        splits={"train": [shard]},
        recordings=entries,
    )
    write_index(tmp_path, written)
    failing = samples.choose_samples(tmp_path, ("train",))[0].rows
    assert [c.recording for c in failing] == [0, 0, 1, 1]
    assert all(begins[c.row] > 0 for c in failing)
    for one, other in (failing[:2], failing[2:]):
        assert 5 in begins[[one.row, other.row]]
        assert other.stamp_ns - one.stamp_ns >= 3 * 10**8


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
    told: dict[str, Any] = dict(opened.index.configuration)
    told["dataset"] = {**told["dataset"], "trajectory_image": {"behind": 1.0}}
    index = opened.index.model_copy(update={"configuration": told})
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
    ("aspect", "told"), [(0.4, "squeezed to 40 %"), (1.5, "stretched to 150 %"), (1.0, "")]
)
def test_a_picture_of_another_aspect_is_said_to_be(dataset: Path, aspect: float, told: str) -> None:
    scene = dataclasses.replace(scene_of(dataset), pixel_aspect=aspect)
    found = page._caption(scene, "train", 0).partition("ns.")[2]
    assert found == (f" As stored, the picture is {told} of its width." if told else "")


def test_a_row_is_written_as_a_picture(dataset: Path, tmp_path: Path) -> None:
    write_row_picture(dataset, "train", 3, tmp_path / "row.png", dpi=50)
    assert _size((tmp_path / "row.png").read_bytes()) == (250, 680)


def _size(png: bytes) -> tuple[int, int]:
    decoded = cv2.imdecode(np.frombuffer(png, np.uint8), cv2.IMREAD_COLOR)
    assert decoded is not None
    height, width = decoded.shape[:2]
    return height, width
