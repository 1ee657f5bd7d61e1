"""Simulate a scenario many times: independent recordings, each of its own seed."""

from __future__ import annotations

import shutil
import time
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from graspe_data.atomic_file import PARTIAL_SUFFIX
from graspe_data.errors import RecordingError, StageError
from graspe_data.recordings.writing import Container
from graspe_data.robot import Robot
from graspe_data.simulation.recorded_truth import (
    read_scenario_text,
    read_truth,
    scenario_text,
    truth_path,
)
from graspe_data.simulation.recording import record_scenario
from graspe_data.simulation.scenario import Scenario
from pipelines.executors import Workers, run_all
from pipelines.progress import Progress


@dataclass(frozen=True)
class Simulated:
    """A recording: where it lies, how many failures of each kind it holds, and what it took.

    ``wall_s`` is None where the recording was there already.
    """

    path: Path
    seed: int
    events: dict[str, int]
    wall_s: float | None


@dataclass(frozen=True)
class _Job:
    scenario: Scenario
    robot: Robot
    container: Container
    folder: Path
    threads: int


def simulate(
    scenario: Scenario,
    robot: Robot,
    seeds: range,
    container: Container,
    out: Path,
    workers: Workers,
    progress: Progress,
) -> list[Simulated]:
    """Write a recording of each seed into a folder; those that are there already stay.

    Raises:
        ManifestError: The world cannot be built as the scenario asks.
        RecordingError: A recording of that name is of something else.
        StageError: A worker process died.
    """
    out.mkdir(parents=True, exist_ok=True)
    threads = 0 if workers.processes == 1 and workers.scheduler is None else 1
    job = _Job(scenario, robot, container, out, threads)
    progress.start("recordings", len(seeds))
    done: dict[int, Simulated] = {}
    for seed, simulated in run_all(workers, partial(_simulate_one, job), seeds):
        if simulated is None:
            raise StageError(
                f"{_target(job, seed)}: the worker process died, most often for want of memory: "
                f"use fewer workers, or a smaller world."
            )
        done[seed] = simulated
        progress.advance(str(simulated.path))
    return [done[seed] for seed in seeds]


def _target(job: _Job, seed: int) -> Path:
    suffix = ".bag" if job.container == "bag" else ""
    return job.folder / f"{job.scenario.name}-{seed}{suffix}"


def _simulate_one(job: _Job, seed: int) -> Simulated:
    target, begun = _target(job, seed), time.monotonic()
    if target.exists():
        _check_same(job, seed, target)
        return Simulated(target, seed, _counts(target), None)
    partial_folder = job.folder / f".{target.name}{PARTIAL_SUFFIX}"
    shutil.rmtree(partial_folder, ignore_errors=True)
    partial_folder.mkdir()
    written = partial_folder / target.name
    try:
        record_scenario(job.scenario, job.robot, seed, written, job.container, threads=job.threads)
        truth_path(written).replace(truth_path(target))
        written.rename(target)
    finally:
        shutil.rmtree(partial_folder, ignore_errors=True)
    return Simulated(target, seed, _counts(target), time.monotonic() - begun)


def _check_same(job: _Job, seed: int, target: Path) -> None:
    if read_scenario_text(target) != scenario_text(job.scenario, seed):
        raise RecordingError(
            f"{target}: exists already, and is not of this scenario as it stands now. Remove it, "
            f"name the scenario anew, or give another --out."
        )


def _counts(path: Path) -> dict[str, int]:
    kinds = [event.kind for event in read_truth(path).events]
    return {kind: kinds.count(kind) for kind in sorted(set(kinds))}
