"""Tasks on a Dask cluster, whatever of it dies."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import BrokenExecutor
from contextlib import ExitStack, contextmanager
from typing import Any, TypeVar

from graspe_data.errors import StageError

Task = TypeVar("Task")
Result = TypeVar("Result")

RETRIES = 3
CONNECT_TIMEOUT = "10s"
WORKER_TIMEOUT_S = 60


def run_on_cluster(
    address: str, function: Callable[[Task], Result], tasks: Sequence[Task]
) -> Iterator[tuple[Task, Result | None]]:
    """Run a function over independent tasks; results come as they are done.

    Tasks of a worker that dies move on to others. One that has seen too many die may only have
    waited beside the culprit: it runs again when the others are done, alone, and gives None when
    its workers die again. These are Dask's own futures, since those of its executor are never done
    when a connection breaks.

    Raises:
        StageError: The cluster cannot be reached, or went away.
    """
    with _cluster(address) as client:
        from distributed import as_completed  # noqa: PLC0415

        def submit(task: Task) -> Any:
            return client.submit(function, task, pure=False, retries=RETRIES)

        futures = {submit(task): task for task in tasks}
        suspects = []
        for future in as_completed(list(futures), loop=client.loop):  # type: ignore[no-untyped-call]
            try:
                result = _result(address, future)
            except BrokenExecutor:
                suspects.append(futures[future])
            else:
                yield futures[future], result
        for task in suspects:
            try:
                result = _result(address, submit(task))
            except BrokenExecutor:
                result = None
            yield task, result


def _result(address: str, future: Any) -> Any:
    """The result of a future; BrokenExecutor where its workers died."""
    from distributed import CancelledError, KilledWorker  # noqa: PLC0415
    from distributed.comm.core import CommClosedError  # noqa: PLC0415

    try:
        return future.result()
    except KilledWorker as error:
        raise BrokenExecutor(str(error)) from error
    except (CancelledError, CommClosedError) as error:
        raise StageError(
            f"the Dask scheduler at {address} went away. Start it and its workers again, then run "
            f"the same command: it goes on where it stopped."
        ) from error


@contextmanager
def _cluster(address: str) -> Iterator[Any]:
    try:
        from distributed import Client  # noqa: PLC0415
    except ImportError as error:
        raise StageError(
            "--scheduler needs Dask: install the `cluster` extra: pip install 'graspe[cluster]'."
        ) from error
    with _quiet("distributed.client", "tornado.application"), ExitStack() as stack:
        try:
            client = Client(address, timeout=CONNECT_TIMEOUT, set_as_default=False)  # type: ignore[no-untyped-call]
            stack.enter_context(client)
        except (OSError, ValueError) as error:
            raise StageError(
                f"no Dask scheduler answers at {address}: {error}. Start one with `dask scheduler` "
                f"and workers with `dask worker {address}`."
            ) from error
        try:
            client.wait_for_workers(1, timeout=WORKER_TIMEOUT_S)
        except TimeoutError as error:
            raise StageError(
                f"the Dask scheduler at {address} has no workers. Start some with `dask worker "
                f"{address}`."
            ) from error
        yield client


@contextmanager
def _quiet(*names: str) -> Iterator[None]:
    """Keep loggers from printing tracebacks of what is an error with its own text here."""
    loggers = [logging.getLogger(name) for name in names]
    levels = [logger.level for logger in loggers]
    for logger in loggers:
        logger.setLevel(logging.CRITICAL + 1)
    try:
        yield
    finally:
        for logger, level in zip(loggers, levels, strict=True):
            logger.setLevel(level)
