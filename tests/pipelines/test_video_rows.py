"""Rows of a recording whose camera is a video show the picture of their own stamp."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from graspe_data.errors import RecordingError
from graspe_data.inspection.inspection import inspect_recording
from graspe_data.recordings import RecordingWriter, open_recording, recording_digest
from graspe_data.recordings.decoding.video_messages import COMPRESSED_VIDEO, FFMPEG_PACKET
from graspe_data.recordings.message_types import message_classes
from graspe_data.recordings.writing import Container
from graspe_data.robot import Intrinsics
from graspe_data.simulation.message_stream import MessageStream
from graspe_data.simulation.motion.drivers import Leg
from pipelines.dataset_settings import DatasetRecipe
from pipelines.episode import whole_column
from pipelines.stages.extract import extract
from pipelines.stages.stage import Work
from tests.conftest import GardenDrive
from tests.graspe_data.recordings.decoding.encoded_video import (
    HEIGHT,
    SHADES,
    WIDTH,
    encode,
    number_in,
)

GROUP = 8
IMAGE = "/camera/color/image_raw/compressed"


@pytest.fixture(scope="module")
def drive(garden_drive: GardenDrive) -> list[tuple[str, Any, int]]:
    """Eight seconds of all sensors: topic, message, bag time."""
    driven = garden_drive((Leg(8.0, 0.5, 0.0),), camera={"width": WIDTH, "height": HEIGHT})
    return [(m.topic, m.content, m.stamp_ns + m.delay_ns) for m in MessageStream(driven)]


Recorded = tuple[Path, list[int]]
Record = Callable[..., Recorded]


@pytest.fixture
def record(tmp_path: Path, drive: list[tuple[str, Any, int]], recipe: DatasetRecipe) -> Record:
    """Record the drive with its pictures as a video, and give the stamps of the pictures."""

    def recorded(kind: str, container: Container = "mcap", lost: tuple[int, ...] = ()) -> Recorded:
        stamps: list[int] = []
        image = recipe.robot.topics.image
        count = sum(topic == image for topic, _, _ in drive)
        packets = encode("h264", count, GROUP)
        path = tmp_path / ("drive.bag" if container == "bag" else "drive")
        with RecordingWriter(path, container) as writer:
            for topic, content, bag_ns in drive:
                if topic != image:
                    writer.write(topic, content, bag_ns)
                    continue
                number, header = len(stamps), content.header
                stamps.append(header.stamp.sec * 10**9 + header.stamp.nanosec)
                if number not in lost:
                    packet = video(kind, header, number, packets[number].data)
                    writer.write(topic, packet, bag_ns)
        return path, stamps

    return recorded


def video(kind: str, header: Any, number: int, data: bytes) -> Any:
    classes, content = message_classes(), np.frombuffer(data, np.uint8)
    if kind == COMPRESSED_VIDEO:
        return classes[kind](header.stamp, header.frame_id, content, "h264")
    encoding = "h264;yuv420p;bgr8;bgr8"
    return classes[kind](header, WIDTH, HEIGHT, encoding, number, 0, False, content)


def shown(path: Path, recipe: DatasetRecipe, folder: Path) -> tuple[Any, dict[int, float]]:
    """What extract records, and the number that each row shows, by its stamp."""
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    with open_recording(path):
        record = extract(Work(path, recording_digest(path), recipe), folder, "key")
    if not record.rows:
        return record, {}
    stamps, images = whole_column(folder, "stamp_ns"), whole_column(folder, "image")
    pairs = zip(stamps.tolist(), images, strict=True)
    return record, {stamp: number_in(image) for stamp, image in pairs}


@pytest.mark.parametrize("container", ["mcap", "db3", "bag"])
@pytest.mark.parametrize("kind", [COMPRESSED_VIDEO, FFMPEG_PACKET])
def test_every_row_shows_its_own_picture(
    record: Record, recipe: DatasetRecipe, tmp_path: Path, kind: str, container: Container
) -> None:
    path, stamps = record(kind, container)
    _, rows = shown(path, recipe, tmp_path / "episode")
    assert len(rows) > 10
    for stamp, number in rows.items():
        assert number == pytest.approx(stamps.index(stamp) % SHADES, abs=0.6)


def test_a_lost_packet_costs_the_rows_up_to_the_next_key_frame(
    record: Record, recipe: DatasetRecipe, tmp_path: Path
) -> None:
    path, stamps = record(COMPRESSED_VIDEO, lost=(17,))
    found, rows = shown(path, recipe, tmp_path / "episode")
    numbers = {stamps.index(stamp) for stamp in rows}
    assert not numbers & set(range(17, 24))
    assert numbers & set(range(24, 32))
    for stamp, number in rows.items():
        assert number == pytest.approx(stamps.index(stamp) % SHADES, abs=0.6)
    assert any("a packet of the video was lost" in loss.reason for loss in found.losses)


def test_inspection_looks_at_a_video_from_its_first_key_frame(record: Record) -> None:
    path, _ = record(FFMPEG_PACKET, lost=(0, 1, 2))
    report = next(t for t in inspect_recording(path).topics if t.name == IMAGE)
    content: Any = report.content
    assert (content.width, content.height) == (WIDTH, HEIGHT)
    assert report.undecodable == GROUP - 3


def test_a_lens_that_cannot_be_undone_refuses_the_recording(
    record: Record, recipe: DatasetRecipe, tmp_path: Path
) -> None:
    path, _ = record(COMPRESSED_VIDEO)
    lens = Intrinsics(
        width=WIDTH,
        height=HEIGHT,
        fx=50.0,
        fy=50.0,
        cx=31.5,
        cy=23.5,
        distortion_model="plumb_bob",
        distortion=(-9.0, 0.0, 0.0, 0.0, 0.0),
    )
    camera = recipe.robot.camera.model_copy(update={"intrinsics": lens})
    robot = recipe.robot.model_copy(update={"camera": camera})
    with pytest.raises(RecordingError, match=r"drive: Distortion plumb_bob .* folds back"):
        shown(path, recipe.model_copy(update={"robot": robot}), tmp_path / "episode")
