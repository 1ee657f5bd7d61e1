"""A small dataset to report on, and a reader of pages."""

from __future__ import annotations

from collections.abc import Mapping
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from graspe_data.observation.labels.anchor_state import AnchorState
from graspe_data.robot import Footprint, Limits, Robot, Topics
from graspe_data.shards.dataset_index import (
    DatasetIndex,
    RecordingEntry,
    write_index,
)
from graspe_data.shards.shard_writer import write_shard
from pipelines.dataset_settings import DatasetManifest, DatasetRecipe
from pipelines.report import balance, notices, write_report
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
    """So many rows, of which the first ones fail from their sixth step on.

    These are failing at their anchors, the last one stands, and the others drive.
    """
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
    rows["state"][:] = AnchorState.DRIVING
    rows["state"][-1] = AnchorState.STANDING
    rows["state"][:failing] = AnchorState.FAILING
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


def notices_of(folder: Path, rows: Rows, *others: RecordingEntry) -> list[str]:
    """What a dataset of these rows, all in train, and of recordings without rows has to tell."""
    columns = row_columns(recipe())
    shard = write_shard(folder, "shards/train.npz", columns, rows)
    entry = RecordingEntry(name="a", digest="ab" * 32, group="a", split="train", rows=8)
    written = DatasetIndex(
        name="tiny",
        columns=tuple(columns),
        group_key="day",
        splits={"train": [shard]},
        recordings=[entry, *others],
    )
    index = write_index(folder, written)
    return notices.notices(folder, index, {"train": balance.split_balance(folder, index, "train")})
