"""Where independent tasks run: here, in local processes, or on a Dask cluster."""

from __future__ import annotations

import multiprocessing
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import BrokenExecutor, Executor, ProcessPoolExecutor, as_completed
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from typing import TypeVar

import cv2

from graspe_data.errors import StageError

Task = TypeVar("Task")
Result = TypeVar("Result")

RETRIES = 3


@dataclass(frozen=True)
class Workers:
    """Local processes, or the address of a Dask scheduler such as ``tcp://host:8786``."""

    processes: int = 1
    scheduler: str | None = None


def run_all(
    workers: Workers, function: Callable[[Task], Result], tasks: Sequence[Task]
) -> Iterator[tuple[Task, Result | None]]:
    """Run a function over independent tasks; results come as they are done.

    A worker process that dies takes its pool with it. The tasks that were not done then run again,
    each in a process of its own, and one that kills its worker again gives None.

    Raises:
        StageError: The cluster cannot be reached.
    """
    if workers.scheduler is None and workers.processes == 1:
        yield from ((task, function(task)) for task in tasks)
        return
    left = dict(enumerate(tasks))
    with suppress(BrokenExecutor), _executor(workers) as executor:
        futures = {executor.submit(function, task): index for index, task in left.items()}
        for future in as_completed(futures):
            result = future.result()
            yield left.pop(futures[future]), result
    for task in left.values():
        yield task, _run_alone(function, task)


def _run_alone(function: Callable[[Task], Result], task: Task) -> Result | None:
    try:
        with _executor(Workers()) as executor:
            return executor.submit(function, task).result()
    except BrokenExecutor:
        return None


@contextmanager
def _executor(workers: Workers) -> Iterator[Executor]:
    if workers.scheduler is None:
        spawn = multiprocessing.get_context("spawn")
        with ProcessPoolExecutor(
            workers.processes, mp_context=spawn, initializer=one_thread
        ) as pool:
            yield pool
        return
    with ExitStack() as stack:
        yield _dask_executor(workers.scheduler, stack)


def _dask_executor(address: str, stack: ExitStack) -> Executor:
    try:
        from distributed import Client  # noqa: PLC0415
    except ImportError as error:
        raise StageError(
            "--scheduler needs Dask: install the `cluster` extra: pip install 'graspe[cluster]'."
        ) from error
    try:
        client = stack.enter_context(Client(address, timeout="10s", set_as_default=False))
    except (OSError, ValueError) as error:
        raise StageError(
            f"no Dask scheduler answers at {address}: {error}. Start one with `dask scheduler` and "
            f"workers with `dask worker {address}`."
        ) from error
    client.run(one_thread)
    executor: Executor = client.get_executor(pure=False, retries=RETRIES)
    return stack.enter_context(executor)


def one_thread() -> None:
    """Leave the cores to the workers: OpenCV stays within the calling thread."""
    cv2.setNumThreads(1)
