"""A recording of any length for benchmarks: 640x480 JPEG, VLP-16 with every return, 10 Hz."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

from graspe_data.manifest import find_manifest, load_manifest
from graspe_data.recordings.writing import Compression, Container, RecordingWriter
from graspe_data.robot import Robot
from graspe_data.simulation.message_stream import START_NS, MessageStream
from graspe_data.simulation.motion.drivers import Leg, ScriptedDriver
from graspe_data.simulation.scenario import Scenario
from graspe_data.simulation.simulated_drive import simulate_drive

SECOND = 1_000_000_000
LOOP_S = 4
NORTH, SOUTH, EAST, WEST = (
    ((-20.0, 18.0), (20.0, 18.0)),
    ((-20.0, -18.0), (20.0, -18.0)),
    ((18.0, -20.0), (18.0, 20.0)),
    ((-18.0, -20.0), (-18.0, 20.0)),
)
COURTYARD = {
    "name": "courtyard",
    "duration_s": LOOP_S,
    "world": {
        "length": 42.0,
        "width": 42.0,
        "ground": {"cover": "gravel", "amplitude": 0.0},
        "features": [
            {"kind": "wall", "lines": [NORTH, SOUTH, EAST, WEST], "height": [12.0, 12.0]},
            {"kind": "tree", "at": [[4.0, 1.2], [7.0, -1.5], [-5.0, 3.0]]},
            {"kind": "tall_grass", "at": [[5.0, 5.5]], "radius": [2.5, 2.5]},
        ],
    },
    "camera": {"width": 640, "height": 480, "rate": 10.0},
    "lidar": {"rate": 10.0},
}


class LoopedDrive:
    """Four seconds of real pictures and clouds, given new stamps again and again."""

    def __init__(self) -> None:
        scenario = Scenario.model_validate(COURTYARD)
        robot = load_manifest(find_manifest("robots", scenario.robot), Robot)
        driver = ScriptedDriver([Leg(LOOP_S, 0.6, 0.1)])
        self._mounting, *self._loop = MessageStream(
            simulate_drive(scenario, robot, 0, driver=driver)
        )

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
            mounting = self._mounting
            writer.write(mounting.topic, mounting.content, START_NS + start_s * SECOND)
            for turn in range(seconds // LOOP_S):
                later = (start_s + turn * LOOP_S) * SECOND
                for message in self._loop:
                    stamp_ns = message.stamp_ns + later
                    moved = _restamped(message.content, stamp_ns)
                    writer.write(message.topic, moved, stamp_ns + message.delay_ns)


def _restamped(content: Any, stamp_ns: int) -> Any:
    if hasattr(content, "transforms"):
        moved = [_restamped(transform, stamp_ns) for transform in content.transforms]
        return dataclasses.replace(content, transforms=moved)
    if not hasattr(content, "header"):
        return content
    seconds, nanoseconds = divmod(stamp_ns, SECOND)
    stamp = dataclasses.replace(content.header.stamp, sec=seconds, nanosec=nanoseconds)
    return dataclasses.replace(content, header=dataclasses.replace(content.header, stamp=stamp))
