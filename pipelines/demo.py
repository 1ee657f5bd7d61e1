"""The demo: recordings that it writes itself, in all three containers, and a dataset of them."""

from __future__ import annotations

import shutil
from dataclasses import dataclass
from pathlib import Path

from graspe_data.atomic_file import PARTIAL_SUFFIX
from graspe_data.recordings.writing import Compression, Container
from graspe_data.simulation.plain_world import Block, Trunk, World
from graspe_data.simulation.scripted_drive import Leg, drive
from graspe_data.simulation.scripted_recording import Sensors, record_drive
from pipelines.build import BuildResult, build_dataset
from pipelines.dataset_settings import load_recipe
from pipelines.executors import Workers, run_all
from pipelines.progress import Progress


@dataclass(frozen=True)
class DemoRecording:
    """One recording of the demo."""

    name: str
    container: Container
    compression: Compression
    world: World
    legs: tuple[Leg, ...]
    light: float = 1.0


OPEN_GROUND = DemoRecording(
    name="open_ground.bag",
    container="bag",
    compression="lz4",
    world=World(
        trunks=(Trunk(5, 1.3, 0.2, 4), Trunk(8, -1.5, 0.25, 5), Trunk(11, 2.5, 0.3, 5)),
        blocks=(Block((9.2, 10), (-3, 4), 2.0), Block((-6, -5), (-4, 4), 2.0)),
    ),
    legs=(
        Leg(9, 0.6, 0.0),
        Leg(4, 0.5, 0.25),
        Leg(4, 0.5, -0.25),
        Leg(4, 0.6, 0.0, "collision"),
        Leg(5, 0.0, 0.4),
        Leg(4, 0.4, 0.0),
    ),
)
TALL_GRASS = DemoRecording(
    name="tall_grass",
    container="db3",
    compression="none",
    world=World(
        trunks=(Trunk(6, 4, 0.3, 5), Trunk(12, -4, 0.3, 5)),
        blocks=(Block((1.5, 16), (-6, 6), 0.9, grass=True),),
    ),
    legs=(Leg(10, 0.5, 0.0), Leg(5, 0.5, 0.2), Leg(5, 0.5, 0.0, "stuck"), Leg(8, 0.5, -0.2)),
)
DUSK = DemoRecording(
    name="dusk",
    container="mcap",
    compression="zstd",
    world=World(
        trunks=tuple(Trunk(3 + 2 * i, 2.2 * (-1) ** i, 0.2, 4) for i in range(6)),
        blocks=(Block((4, 8), (3, 6), 0.7, grass=True),),
    ),
    legs=(Leg(12, 0.6, 0.0), Leg(6, 0.5, 0.15), Leg(4, 0.4, -0.3), Leg(3, 0.5, 0.0, "stuck")),
    light=0.22,
)
RECORDINGS = (OPEN_GROUND, TALL_GRASS, DUSK)


@dataclass(frozen=True)
class _Task:
    folder: Path
    recording: DemoRecording


def write_demo_recordings(folder: Path, workers: Workers, progress: Progress) -> list[Path]:
    """Write the recordings of the demo; those that are there already stay."""
    folder.mkdir(parents=True, exist_ok=True)
    tasks = [_Task(folder, recording) for recording in RECORDINGS]
    progress.start("drives", len(tasks))
    for _, path in run_all(workers, _write, tasks):
        progress.advance(str(path))
    return [folder / recording.name for recording in RECORDINGS]


def run_demo(out: Path, workers: Workers, progress: Progress) -> BuildResult:
    """Write recordings below a folder and build a dataset of them, ``dataset``, beside."""
    recordings = write_demo_recordings(out / "recordings", workers, progress)
    return build_dataset(load_recipe("demo"), recordings, out / "dataset", workers, progress)


def _write(task: _Task) -> Path:
    target, recording = task.folder / task.recording.name, task.recording
    if target.exists():
        return target
    partial = task.folder / f".{recording.name}{PARTIAL_SUFFIX}"
    shutil.rmtree(partial, ignore_errors=True)
    partial.mkdir()
    record_drive(
        partial / recording.name,
        recording.container,
        recording.world,
        drive(recording.legs),
        Sensors(light=recording.light),
        seed=1,
        compression=recording.compression,
    )
    (partial / recording.name).rename(target)
    partial.rmdir()
    return target
