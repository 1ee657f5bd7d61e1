"""A build that is killed at any moment, and run again: the same bytes, and nothing done twice."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import IO

import numpy as np
import pytest

from graspe_data.progress import Silent
from graspe_data.simulation.motion.drivers import Leg
from pipelines.build import build_dataset
from pipelines.dataset_settings import DatasetRecipe
from pipelines.executors import Workers, run_all
from tests.pipelines.conftest import RecordingFactory
from tests.pipelines.fatal_task import fatal_for_three
from tests.pipelines.file_digests import file_digests

ROOT = Path(__file__).resolve().parents[2]
SAMPLE, SOAK = 6, 100
LEGS = (Leg(2.5, 0.6, 0.0), Leg(1.0, 0.5, 0.3))
STAGES = {"extract", "reliability", "trajectory", "label"}


@dataclass(frozen=True)
class Job:
    """A build: what of, how, and what an undisturbed one gives in how long."""

    recipe: Path
    recordings: list[Path]
    tree: dict[str, str]
    seconds: dict[int, float]


@pytest.fixture
def job(record: RecordingFactory, recipe: DatasetRecipe, tmp_path: Path) -> Job:
    containers = ("bag", "db3", "mcap", "mcap")
    recordings = [
        record(f"drive{seed}", container, seed, LEGS)  # type: ignore[arg-type]
        for seed, container in enumerate(containers)
    ]
    (tmp_path / "recipe.json").write_text(recipe.model_dump_json())
    job = Job(tmp_path / "recipe.json", recordings, {}, {})
    for workers in (1, 2):
        out = tmp_path / f"undisturbed{workers}"
        with _started(job, out, workers) as process:
            since = time.monotonic()
            assert process.wait(60) == 0
            job.seconds[workers] = time.monotonic() - since
        job.tree.update(file_digests(out))
        assert file_digests(out) == job.tree
    return job


def test_a_killed_build_goes_on_to_the_same_bytes(
    job: Job, recipe: DatasetRecipe, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with capsys.disabled():
        _kill_and_go_on(job, recipe, tmp_path, SAMPLE)


@pytest.mark.soak
def test_a_build_killed_a_hundred_times_goes_on_to_the_same_bytes(
    job: Job, recipe: DatasetRecipe, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with capsys.disabled():
        _kill_and_go_on(job, recipe, tmp_path, SOAK)


def test_the_workers_end_with_a_killed_build(job: Job, tmp_path: Path) -> None:
    with _started(job, tmp_path / "out", 2) as process:
        time.sleep(job.seconds[2] / 2)
        process.kill()
    group = process.pid
    deadline = time.monotonic() + 20
    while _members(group) and time.monotonic() < deadline:
        time.sleep(0.05)
    assert not _members(group)


def test_a_task_that_kills_its_worker_gives_none_and_the_others_are_done() -> None:
    results = dict(run_all(Workers(processes=2), fatal_for_three, range(5)))
    assert results == {0: 0, 1: 1, 2: 4, 3: None, 4: 16}


def _kill_and_go_on(job: Job, recipe: DatasetRecipe, folder: Path, kills: int) -> None:
    generator = np.random.default_rng(kills)
    found: Counter[str] = Counter()
    for number in range(kills):
        workers, out = 1 + number % 2, folder / f"killed{number}"
        moment = generator.uniform(0, job.seconds[workers])
        with _started(job, out, workers) as process:
            time.sleep(moment)
            _kill(process, whole_group=number % 4 >= 2)
        finished = _stages(out)
        found[_state(out, finished)] += 1
        result = build_dataset(recipe, job.recordings, out, Workers(), Silent())
        assert file_digests(out) == job.tree
        after = _stages(out)
        assert {stage: after[stage] for stage in finished} == finished
        assert not _complete_episodes(finished) & _worked_on(result.worked_on, out)
    sys.stderr.write(f"\n{kills} kills, found then: {dict(found)}\n")


@contextmanager
def _started(job: Job, out: Path, workers: int) -> Iterator[subprocess.Popen[str]]:
    """A build in a process group of its own, from the moment that it begins."""
    arguments = (str(job.recipe), str(out), str(workers), *map(str, job.recordings))
    with (
        out.with_name(f"{out.name}.log").open("w") as log,
        subprocess.Popen(
            [sys.executable, "-m", "tests.pipelines.build_child", *arguments],
            cwd=ROOT,
            stdout=subprocess.PIPE,
            stderr=log,
            text=True,
            start_new_session=True,
        ) as process,
    ):
        try:
            output: IO[str] | None = process.stdout
            assert output is not None
            assert output.readline() == "begins\n"
            yield process
        finally:
            process.kill()


def _kill(process: subprocess.Popen[str], *, whole_group: bool) -> None:
    """Kill the build alone, as a memory killer does, or with its workers, as a power cut does."""
    if whole_group:
        os.killpg(process.pid, signal.SIGKILL)
    process.kill()
    process.wait(30)


def _members(group: int) -> list[int]:
    """The processes of a group that still run."""
    found = []
    for status in Path("/proc").glob("[0-9]*/stat"):
        try:
            state, _, member_of = status.read_text().rpartition(")")[2].split()[:3]
        except OSError:
            continue
        if int(member_of) == group and state != "Z":
            found.append(int(status.parent.name))
    return found


def _stages(out: Path) -> dict[str, tuple[int, int]]:
    """Inode and time of change of each committed stage."""
    return {
        str(path.relative_to(out)): (path.stat().st_ino, path.stat().st_mtime_ns)
        for path in out.glob("episodes/*/[a-z]*")
    }


def _complete_episodes(stages: dict[str, tuple[int, int]]) -> set[str]:
    done: dict[str, set[str]] = {}
    for path in stages:
        _, episode, stage = Path(path).parts
        done.setdefault(episode, set()).add(stage.split("-")[0])
    return {episode for episode, names in done.items() if names >= STAGES}


def _worked_on(names: tuple[str, ...], out: Path) -> set[str]:
    records = [path.read_text() for path in out.glob("episodes/*/extract-*/stage.json")]
    folders = [path.parent.parent.name for path in out.glob("episodes/*/extract-*/stage.json")]
    return {
        folder
        for folder, record in zip(folders, records, strict=True)
        if any(f'"recording":"{name}"' in record for name in names)
    }


def _state(out: Path, stages: dict[str, tuple[int, int]]) -> str:
    if (out / "dataset.json").is_file():
        return "dataset.json committed"
    if list(out.glob("shards/*.npz")):
        return "some shards"
    return "some stages" if stages else "nothing finished"
