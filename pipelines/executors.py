"""Where independent tasks run: here, in local processes, or on a Dask cluster."""

from __future__ import annotations

import multiprocessing
import os
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import BrokenExecutor, ProcessPoolExecutor, as_completed
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from multiprocessing.connection import wait
from typing import TypeVar

import cv2

from pipelines.dask_cluster import run_on_cluster

PRELOADED = ["pipelines.process_recording", "pipelines.stages.shard"]

Task = TypeVar("Task")
Result = TypeVar("Result")


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
    each in a process of its own, and one that kills its worker again gives None; on a cluster too.

    Raises:
        StageError: The cluster cannot be reached, or went away.
    """
    if workers.scheduler is not None:
        yield from run_on_cluster(workers.scheduler, partial(_in_one_thread, function), tasks)
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
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(PRELOADED)
    return ProcessPoolExecutor(count, mp_context=context, initializer=_start_local_worker)


def _start_local_worker() -> None:
    one_thread()
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    """End this worker when the build is killed; its pool would wait for work for ever."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        wait([parent.sentinel])
        os._exit(1)


def _in_one_thread(function: Callable[[Task], Result], task: Task) -> Result:
    one_thread()
    return function(task)
