"""A real Dask scheduler and workers on this machine: the same bytes, whatever dies."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import pytest

from graspe_data.errors import StageError
from graspe_data.progress import Silent
from graspe_data.simulation.motion.drivers import Leg
from pipelines import dask_cluster
from pipelines.build import build_dataset
from pipelines.dataset_settings import DatasetRecipe
from pipelines.executors import Workers, run_all
from tests.pipelines.conftest import RecordingFactory
from tests.pipelines.fatal_task import fatal_for_three
from tests.pipelines.file_digests import file_digests

pytest.importorskip("distributed", reason="needs the `cluster` extra")

ROOT = Path(__file__).resolve().parents[2]
LEGS = (Leg(3.0, 0.6, 0.1),)
START_S = 60


class Cluster:
    """A scheduler and two workers with their nannies, each in a process group of its own."""

    def __init__(self, folder: Path, stack: ExitStack) -> None:
        self.folder, self._stack = folder, stack
        contact = folder / "scheduler.json"
        self.scheduler = self._start("scheduler", "--port", "0", "--scheduler-file", str(contact))
        _wait_for(lambda: contact.is_file() and bool(contact.read_bytes()))
        self.address: str = json.loads(contact.read_bytes())["address"]
        self.workers = [
            self._start("worker", self.address, "--nthreads", "1", "--local-directory", str(folder))
            for _ in range(2)
        ]

    def _start(self, *command: str) -> subprocess.Popen[bytes]:
        with (self.folder / "log.txt").open("ab") as log:
            process = subprocess.Popen(
                [sys.executable, "-m", "dask", *command, "--host", "127.0.0.1", "--no-dashboard"],
                cwd=ROOT,
                env={**os.environ, "DASK_DISTRIBUTED__SCHEDULER__ALLOWED_FAILURES": "1"},
                stdout=log,
                stderr=log,
                start_new_session=True,
            )
        self._stack.callback(kill, process)
        return process


def kill(process: subprocess.Popen[bytes]) -> None:
    """Kill a process and its children."""
    if process.poll() is None:
        os.killpg(process.pid, signal.SIGKILL)
        process.wait(30)


class AfterFirst(Silent):
    """Does something when the first recording is done."""

    def __init__(self, action: Callable[[], None]) -> None:
        self.action: Callable[[], None] | None = action

    def advance(self, message: str) -> None:  # noqa: ARG002
        if self.action is not None:
            self.action()
        self.action = None


@pytest.fixture
def cluster(tmp_path: Path) -> Iterator[Cluster]:
    folder = tmp_path / "dask"
    folder.mkdir()
    with ExitStack() as stack:
        yield Cluster(folder, stack)


@pytest.fixture
def recordings(record: RecordingFactory) -> list[Path]:
    return [record(f"drive{seed}", "mcap", seed, LEGS) for seed in range(6)]


def test_a_cluster_gives_the_same_bytes_and_so_it_does_when_a_worker_dies(
    cluster: Cluster, recordings: list[Path], recipe: DatasetRecipe, tmp_path: Path
) -> None:
    build_dataset(recipe, recordings, tmp_path / "local", Workers(), Silent())
    workers = Workers(scheduler=cluster.address)
    build_dataset(recipe, recordings, tmp_path / "cluster", workers, Silent())
    assert file_digests(tmp_path / "cluster") == file_digests(tmp_path / "local")
    dying = AfterFirst(lambda: kill(cluster.workers[0]))
    build_dataset(recipe, recordings, tmp_path / "dying", workers, dying)
    assert cluster.workers[0].poll() is not None
    assert file_digests(tmp_path / "dying") == file_digests(tmp_path / "local")


def test_a_task_that_kills_its_workers_gives_none_and_the_others_are_done(
    cluster: Cluster,
) -> None:
    results = dict(run_all(Workers(scheduler=cluster.address), fatal_for_three, range(5)))
    assert results == {0: 0, 1: 1, 2: 4, 3: None, 4: 16}


def test_a_scheduler_that_dies_is_one_clear_error_and_the_build_goes_on_later(
    cluster: Cluster, recordings: list[Path], recipe: DatasetRecipe, tmp_path: Path
) -> None:
    dying = AfterFirst(lambda: kill(cluster.scheduler))
    workers, out = Workers(scheduler=cluster.address), tmp_path / "out"
    with _at_most(60), pytest.raises(StageError, match=r"the Dask scheduler at .* went away"):
        build_dataset(recipe, recordings, out, workers, dying)
    for worker in cluster.workers:
        kill(worker)
    build_dataset(recipe, recordings, out, Workers(), Silent())
    build_dataset(recipe, recordings, tmp_path / "local", Workers(), Silent())
    assert file_digests(out) == file_digests(tmp_path / "local")


def test_no_scheduler_is_one_clear_error(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(dask_cluster, "CONNECT_TIMEOUT", "1s")
    with pytest.raises(StageError, match=r"no Dask scheduler answers at tcp://127.0.0.1:1"):
        list(run_all(Workers(scheduler="tcp://127.0.0.1:1"), fatal_for_three, range(1)))


def _wait_for(condition: Callable[[], bool]) -> None:
    deadline = time.monotonic() + START_S
    while not condition():
        assert time.monotonic() < deadline, "the scheduler did not start"
        time.sleep(0.05)


@contextmanager
def _at_most(seconds: int) -> Iterator[None]:
    """Fail rather than hang."""

    def fail(signum: int, frame: object) -> None:
        raise TimeoutError(f"not done within {seconds} s")

    before = signal.signal(signal.SIGALRM, fail)
    signal.alarm(seconds)
    try:
        yield
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, before)
