"""Many trials, each in a file of its own; those that are there already stay."""

from __future__ import annotations

import logging
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from graspe_data.atomic_file import write_atomically
from graspe_data.errors import StageError
from graspe_data.progress import Progress
from graspe_data.simulation.field import Field, build_field
from graspe_data.simulation.motion.drive import Drive
from graspe_data.simulation.recorded_truth import truth_path
from graspe_data.simulation.recording import record_drive
from graspe_data.simulation.simulated_drive import SimulatedDrive
from graspe_data.whole_folder import workplace
from pipelines.executors import Workers, run_all
from pipelines.trials.config import Conditions, TrialConfig
from pipelines.trials.methods import Method, make_planner, make_watch, make_witness
from pipelines.trials.run_trial import run_trial
from pipelines.trials.summary import TrialIdentity, summarise
from pipelines.trials.trial import Trial, read_trial
from planners.guarded import LOGGER_NAME

CONDITIONS_FILE = "conditions.json"


@dataclass(frozen=True)
class TrialTask:
    """One trial to run: conditions of its scenario, a seed and a method."""

    conditions: Conditions
    seed: int
    method: Method
    config: TrialConfig
    record: bool = False
    threads: int = 1

    @property
    def inputs(self) -> str:
        """Digest of all that the result depends on."""
        return self.method.inputs(self.conditions.digest, self.seed, self.config)

    def file(self, out: Path) -> Path:
        """Where the trial is written."""
        return out / self.conditions.label / self.method.name / f"{self.seed}.json"


def run_trials(
    tasks: Sequence[TrialTask], out: Path, workers: Workers, progress: Progress
) -> list[Trial]:
    """Run trials and write each to ``OUT/<scenario>/<method>/<seed>.json``.

    A trial whose file is of the same inputs is not run again. One that is recorded has its bag
    beside the file. What all trials of a scenario share is in ``conditions.json`` above them.

    Args:
        tasks: What to run.
        out: The folder.
        workers: Who runs it.
        progress: Who is told.

    Raises:
        ManifestError: A world cannot be built as its scenario asks.
        PlannerError: A bundle is damaged, or was made for another robot.
        StageError: A worker process died, or a file cannot be written.
    """
    for conditions in {task.conditions.label: task.conditions for task in tasks}.values():
        folder = out / conditions.label
        folder.mkdir(parents=True, exist_ok=True)
        content = conditions.model_dump_json(indent=1).encode()
        write_atomically(folder / CONDITIONS_FILE, [content], StageError)
    progress.start("trials", len(tasks))
    done: dict[Path, Trial] = {}
    for task, trial in run_all(workers, partial(_run_one, out), tasks):
        if trial is None:
            raise StageError(
                f"{task.file(out)}: the worker process died, most often for want of memory: use "
                f"fewer workers."
            )
        done[task.file(out)] = trial
        progress.advance(f"{task.file(out)}: {trial.outcome} after {trial.duration_s:.0f} s")
    return [done[task.file(out)] for task in tasks]


def _run_one(out: Path, task: TrialTask) -> Trial:
    file = task.file(out)
    kept = _earlier_trial(task, file)
    if kept is not None:
        return kept
    file.parent.mkdir(parents=True, exist_ok=True)
    scenario, robot, settings = task.conditions.scenario, task.conditions.robot, task.config.trial
    field = build_field(scenario, robot, task.seed, task.threads, front_only=True)
    watch = make_watch(task.method, field, task.config)
    witness = make_witness(task.method, field)
    planner = make_planner(task.method, field, task.config, task.threads, watch, witness)
    with _quiet_planners():
        run = run_trial(field, planner, settings, task.method.senses, witness)
    identity = TrialIdentity(
        task.method.name, task.conditions.digest, task.method.driver(task.config), task.inputs
    )
    trial = summarise(field, run, settings, identity)
    trial = trial.model_copy(update={"scenario": task.conditions.label})
    if watch is not None:
        trial = trial.model_copy(update={"maps": watch.score(field, run.drive)})
    if task.record:
        _record(field, run.drive, _bag_of(file), task.threads)
    trial.write(file)
    return trial


@contextmanager
def _quiet_planners() -> Iterator[None]:
    """Planners log every stop; a trial counts them by their reasons."""
    logger, silent = logging.getLogger(LOGGER_NAME), logging.NullHandler()
    logger.addHandler(silent)
    try:
        yield
    finally:
        logger.removeHandler(silent)


def _earlier_trial(task: TrialTask, file: Path) -> Trial | None:
    """The trial that is there, where it is this one."""
    if not file.is_file() or (task.record and not _bag_of(file).is_file()):
        return None
    try:
        trial = read_trial(file)
    except StageError:
        return None
    return trial if trial.inputs == task.inputs else None


def _bag_of(file: Path) -> Path:
    return file.with_suffix(".bag")


def _record(field: Field, drive: Drive, bag: Path, threads: int) -> None:
    """Record the drive as the robot would have, its whole turns of the lidar included."""
    whole = build_field(field.scenario, field.robot, field.seed, threads)
    with workplace(bag) as folder:
        record_drive(SimulatedDrive.through(whole, drive), folder / bag.name, "bag")
        truth_path(folder / bag.name).replace(truth_path(bag))
        (folder / bag.name).replace(bag)
