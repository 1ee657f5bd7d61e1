"""A call that is waited for no longer than so long."""

from __future__ import annotations

import os
import queue
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Generic, TypeVar

from graspe_data.errors import PlannerError

Answer = TypeVar("Answer")


@dataclass
class _Call(Generic[Answer]):
    """One question; ``pid``: the process whose thread answers it."""

    question: Callable[[], Answer]
    pid: int = field(default_factory=os.getpid)
    begun_s: float = field(default_factory=time.monotonic)
    done: threading.Event = field(default_factory=threading.Event)
    answer: Answer | None = None
    error: BaseException | None = None

    def run(self) -> None:
        try:
            self.answer = self.question()
        except BaseException as error:  # noqa: BLE001 - the caller raises it
            self.error = error


class _Worker:
    """A thread that answers one call after the other, and never ends.

    OpenCV takes a lock of its own where a thread that has called it ends. A process that is forked
    at that moment inherits the lock with nobody to open it, and its first call of OpenCV from a
    new thread waits for ever, with Python's lock held. So no thread ends after an answer.
    """

    def __init__(self) -> None:
        self._calls: queue.SimpleQueue[_Call[Any]] = queue.SimpleQueue()
        threading.Thread(target=self._work, name="planner", daemon=True).start()

    def run(self, call: _Call[Any]) -> None:
        self._calls.put(call)

    def _work(self) -> None:
        while True:
            call = self._calls.get()
            call.run()
            done = call.done
            del call  # an idle thread keeps no planner alive
            _idle.append(self)
            done.set()


_idle: list[_Worker] = []
"""Workers without a call, of all deadlines of this process; append and pop are atomic."""
os.register_at_fork(after_in_child=_idle.clear)


def _worker() -> _Worker:
    try:
        return _idle.pop()
    except IndexError:
        return _Worker()


class Deadline(Generic[Answer]):
    """Asks on another thread, so that a call that hangs holds nobody up.

    A late answer is thrown away, and nothing is asked before it is there. A process that was forked
    meanwhile asks anew. What holds Python's lock all the time cannot be overtaken.
    """

    def __init__(self, seconds: float) -> None:
        """Take how long an answer is waited for."""
        self._seconds = seconds
        self._last: _Call[Answer] | None = None

    def ask(self, question: Callable[[], Answer]) -> Answer:
        """The answer, or what the call raised.

        Raises:
            PlannerError: There is no answer in time.
        """
        last = self._last
        if last is not None and last.pid == os.getpid() and not last.done.is_set():
            raise PlannerError(
                f"no answer yet to the question of {time.monotonic() - last.begun_s:.2f} s ago"
            )
        worker = _worker()
        call = self._last = _Call(question)
        worker.run(call)
        if not call.done.wait(self._seconds):
            raise PlannerError(f"no answer within {self._seconds:g} s")
        if isinstance(call.error, Exception):
            raise call.error
        if call.error is not None or call.answer is None:
            raise PlannerError(f"no answer: {call.error!r}")
        return call.answer
