"""Simulate drives: independent recordings, each of a scenario and a seed."""

from __future__ import annotations

import shutil
import time
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from graspe_data.errors import GraspeError, RecordingError, StageError
from graspe_data.progress import Progress
from graspe_data.recordings.writing import Compression, Container
from graspe_data.robot import Robot
from graspe_data.simulation.recorded_truth import (
    read_scenario_text,
    read_truth,
    scenario_text,
    truth_path,
)
from graspe_data.simulation.recording import record_scenario
from graspe_data.simulation.scenario import Scenario
from graspe_data.whole_folder import workplace
from pipelines.executors import Workers, run_all


@dataclass(frozen=True)
class Simulation:
    """What to record: a scenario with a seed, in a container."""

    scenario: Scenario
    robot: Robot
    seed: int
    container: Container
    compression: Compression = "none"
    habits: str | None = None
    """A robot that ships, whose drivers write; None writes as the simulator does."""

    @property
    def name(self) -> str:
        """The recording's file or folder."""
        suffix = ".bag" if self.container == "bag" else ""
        habits = "" if self.habits is None else f"-{self.habits}"
        return f"{self.scenario.name}-{self.seed}{habits}{suffix}"


@dataclass(frozen=True)
class Simulated:
    """A recording: where it lies, how many failures of each kind it holds, and what it took.

    ``wall_s`` is None where the recording was there already.
    """

    path: Path
    seed: int
    events: dict[str, int]
    wall_s: float | None


def simulate(
    simulations: Sequence[Simulation],
    out: Path,
    workers: Workers,
    progress: Progress,
    *,
    replace: bool = False,
) -> list[Simulated]:
    """Write recordings into a folder; those that are there already stay.

    Args:
        simulations: What to record.
        out: The folder.
        workers: Who records.
        progress: Who is told.
        replace: Record anew what is there under a name but of a scenario that has changed.

    Raises:
        ManifestError: A world cannot be built as its scenario asks.
        RecordingError: A recording of that name is of something else, and not to be replaced.
        StageError: A worker process died.
    """
    out.mkdir(parents=True, exist_ok=True)
    threads = 0 if workers.processes == 1 and workers.scheduler is None else 1
    progress.start("recordings", len(simulations))
    done: dict[str, Simulated] = {}
    record = partial(_simulate_one, out, threads, replace)
    for simulation, simulated in run_all(workers, record, simulations):
        if simulated is None:
            raise StageError(
                f"{out / simulation.name}: the worker process died, most often for want of "
                f"memory: use fewer workers, or a smaller world."
            )
        done[simulation.name] = simulated
        progress.advance(str(simulated.path))
    return [done[simulation.name] for simulation in simulations]


def _simulate_one(out: Path, threads: int, replace: bool, simulation: Simulation) -> Simulated:
    target, begun = out / simulation.name, time.monotonic()
    if target.exists():
        kept = _earlier(simulation, target, replace)
        if kept is not None:
            return kept
        _make_way(target, replace)
    with workplace(target) as folder:
        _record(simulation, folder / target.name, threads)
        _commit(folder / target.name, target)
    return Simulated(target, simulation.seed, _counts(target), time.monotonic() - begun)


def _earlier(simulation: Simulation, target: Path, replace: bool) -> Simulated | None:
    """The recording that is there, where it is this one; a damaged one is none if replaced."""
    try:
        same = _is_same(simulation, target)
        return Simulated(target, simulation.seed, _counts(target), None) if same else None
    except GraspeError:
        if replace:
            return None
        raise


def _commit(made: Path, target: Path) -> None:
    """Move a recording to its place; another process may have made the same one meanwhile."""
    if target.exists():
        return
    truth_path(made).replace(truth_path(target))
    try:
        made.rename(target)
    except OSError:
        if not target.exists():
            raise


def _record(simulation: Simulation, path: Path, threads: int) -> None:
    record_scenario(
        simulation.scenario,
        simulation.robot,
        simulation.seed,
        path,
        simulation.container,
        simulation.compression,
        threads,
        simulation.habits,
    )


def _is_same(simulation: Simulation, target: Path) -> bool:
    text = scenario_text(simulation.scenario, simulation.robot, simulation.seed, simulation.habits)
    return _container_of(target) == simulation.container and read_scenario_text(target) == text


def _container_of(target: Path) -> Container:
    if target.is_file():
        return "bag"
    return "mcap" if any(".mcap" in path.name for path in target.iterdir()) else "db3"


def _make_way(target: Path, replace: bool) -> None:
    if not replace:
        raise RecordingError(
            f"{target}: exists already, and is not of this scenario as it stands now. Remove it, "
            f"name the scenario anew, or give another --out."
        )
    if target.is_dir():
        shutil.rmtree(target)
    else:
        target.unlink()


def _counts(path: Path) -> dict[str, int]:
    kinds = [event.kind for event in read_truth(path).events]
    return {kind: kinds.count(kind) for kind in sorted(set(kinds))}
