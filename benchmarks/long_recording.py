"""A recording of any length for benchmarks: 640x480 JPEG, VLP-16 with every return, 10 Hz."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

import numpy as np

from graspe_data.recordings.writing import Compression, Container, RecordingWriter
from graspe_data.simulation.plain_world import Block, Trunk, World
from graspe_data.simulation.scripted_drive import Leg, drive
from graspe_data.simulation.scripted_recording import START_NS, DriveMessages, Sensors

SECOND = 1_000_000_000
LOOP_S = 4
COURTYARD = World(
    trunks=(Trunk(4, 1.2, 0.2, 5), Trunk(7, -1.5, 0.3, 5), Trunk(-5, 3, 0.3, 5)),
    blocks=(
        Block((18, 19), (-20, 20), 12.0),
        Block((-19, -18), (-20, 20), 12.0),
        Block((-20, 20), (18, 19), 12.0),
        Block((-20, 20), (-19, -18), 12.0),
        Block((2, 9), (3, 8), 0.8, grass=True),
    ),
)


class LoopedDrive:
    """Four seconds of real pictures and clouds, given new stamps again and again."""

    def __init__(self) -> None:
        driven = drive([Leg(LOOP_S, 0.6, 0.1)])
        sensors = Sensors(width=640, height=480)
        self._maker = DriveMessages(COURTYARD, driven, sensors, np.random.default_rng(0))
        self._loop = list(self._maker)

    def write(
        self,
        path: Path,
        container: Container,
        seconds: int,
        start_s: int = 0,
        compression: Compression = "none",
    ) -> None:
        """Write a recording of so many seconds, a multiple of four, that begins later or not."""
        with RecordingWriter(path, container, compression) as writer:
            writer.write("/tf_static", self._maker.mounting(), START_NS + start_s * SECOND)
            for turn in range(seconds // LOOP_S):
                later = (start_s + turn * LOOP_S) * SECOND
                for topic, message, stamp_ns, delay_ns in self._loop:
                    moved = _restamped(message, stamp_ns + later)
                    writer.write(topic, moved, stamp_ns + later + delay_ns)


def _restamped(message: Any, stamp_ns: int) -> Any:
    if not hasattr(message, "header"):
        return message
    seconds, nanoseconds = divmod(stamp_ns, SECOND)
    stamp = dataclasses.replace(message.header.stamp, sec=seconds, nanosec=nanoseconds)
    return dataclasses.replace(message, header=dataclasses.replace(message.header, stamp=stamp))
