"""Where independent tasks run: here, in local processes, or on a Dask cluster."""

from __future__ import annotations

import multiprocessing
import os
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import (
    BrokenExecutor,
    CancelledError,
    Executor,
    ProcessPoolExecutor,
    as_completed,
)
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from functools import partial
from multiprocessing.connection import wait
from typing import TypeVar

import cv2

from graspe_data.errors import StageError

Task = TypeVar("Task")
Result = TypeVar("Result")

RETRIES = 3
CONNECT_TIMEOUT = "10s"


@dataclass(frozen=True)
class Workers:
    """Local processes, or the address of a Dask scheduler such as ``tcp://host:8786``."""

    processes: int = 1
    scheduler: str | None = None


def run_all(
    workers: Workers, function: Callable[[Task], Result], tasks: Sequence[Task]
) -> Iterator[tuple[Task, Result | None]]:
    """Run a function over independent tasks; results come as they are done.

    A local worker process that dies takes its pool with it. The tasks that were not done then run
    again, each in a process of its own, and one that kills its worker again gives None. On a
    cluster a task moves on to other workers, and gives None when it has killed several.

    Raises:
        StageError: The cluster cannot be reached, or went away.
    """
    if workers.scheduler is not None:
        yield from _run_on_cluster(workers.scheduler, function, tasks)
        return
    if workers.processes == 1:
        yield from ((task, function(task)) for task in tasks)
        return
    left = dict(enumerate(tasks))
    with suppress(BrokenExecutor), _local_processes(workers.processes) as executor:
        futures = {executor.submit(function, task): index for index, task in left.items()}
        for future in as_completed(futures):
            result = future.result()
            yield left.pop(futures[future]), result
    for task in left.values():
        yield task, _run_alone(function, task)


def one_thread() -> None:
    """Leave the cores to the workers: OpenCV stays within the calling thread."""
    cv2.setNumThreads(1)


def _run_alone(function: Callable[[Task], Result], task: Task) -> Result | None:
    try:
        with _local_processes(1) as executor:
            return executor.submit(function, task).result()
    except BrokenExecutor:
        return None


def _local_processes(count: int) -> ProcessPoolExecutor:
    spawn = multiprocessing.get_context("spawn")
    return ProcessPoolExecutor(count, mp_context=spawn, initializer=_start_local_worker)


def _start_local_worker() -> None:
    one_thread()
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    """End this worker when the build is killed; its pool would wait for work for ever."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        wait([parent.sentinel])
        os._exit(1)


def _run_on_cluster(
    address: str, function: Callable[[Task], Result], tasks: Sequence[Task]
) -> Iterator[tuple[Task, Result | None]]:
    with _cluster(address) as executor:
        from distributed import KilledWorker  # noqa: PLC0415

        work = partial(_in_one_thread, function)
        futures = {executor.submit(work, task): task for task in tasks}
        for future in as_completed(futures):
            try:
                result = future.result()
            except KilledWorker:
                result = None
            except CancelledError as error:
                raise StageError(
                    f"the Dask scheduler at {address} went away. Start it and its workers again, "
                    f"then run the same command: it goes on where it stopped."
                ) from error
            yield futures[future], result


def _in_one_thread(function: Callable[[Task], Result], task: Task) -> Result:
    one_thread()
    return function(task)


@contextmanager
def _cluster(address: str) -> Iterator[Executor]:
    try:
        from distributed import Client  # noqa: PLC0415
    except ImportError as error:
        raise StageError(
            "--scheduler needs Dask: install the `cluster` extra: pip install 'graspe[cluster]'."
        ) from error
    with ExitStack() as stack:
        try:
            client = Client(address, timeout=CONNECT_TIMEOUT, set_as_default=False)  # type: ignore[no-untyped-call]
            stack.enter_context(client)
        except (OSError, ValueError) as error:
            raise StageError(
                f"no Dask scheduler answers at {address}: {error}. Start one with `dask scheduler` "
                f"and workers with `dask worker {address}`."
            ) from error
        executor: Executor = client.get_executor(pure=False, retries=RETRIES)  # type: ignore[no-untyped-call]
        yield stack.enter_context(executor)
