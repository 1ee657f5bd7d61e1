"""Storage files that may be parts of one recording."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from graspe_data.recordings import RecordingWriter
from graspe_data.recordings.message_types import message_classes
from graspe_data.recordings.writing import Container

CLASSES: Any = message_classes()
SECOND = 1_000_000_000
START = 1_700_000_000 * SECOND
CONTAINERS: tuple[Container, ...] = ("bag", "db3", "mcap")
Part = Callable[..., Path]


@pytest.fixture
def part(tmp_path: Path) -> Part:
    """Write ten messages a second for some seconds into one storage file of a given name."""

    def write(
        name: str,
        start_s: float,
        length_s: float = 5.0,
        container: Container = "bag",
        topic: str = "/words",
        message: Callable[[str], object] = CLASSES["std_msgs/msg/String"],
    ) -> Path:
        folder = tmp_path / "bags"
        folder.mkdir(exist_ok=True)
        target = folder / f"{name}.{container}"
        written = target if container == "bag" else tmp_path / "scratch"
        with RecordingWriter(written, container) as writer:
            for number in range(round(length_s * 10)):
                time_ns = START + round(start_s * SECOND) + number * SECOND // 10
                writer.write(topic, message(f"{name} {number}"), time_ns)
        if container != "bag":
            next(written.glob(f"*.{container}")).rename(target)
            shutil.rmtree(written)
        return target

    return write
