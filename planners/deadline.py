"""A call that is waited for no longer than so long."""

from __future__ import annotations

import os
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Generic, TypeVar

from graspe_data.errors import PlannerError

Answer = TypeVar("Answer")


@dataclass
class _Call(Generic[Answer]):
    """One question; ``pid``: the process whose thread answers it."""

    pid: int = field(default_factory=os.getpid)
    begun_s: float = field(default_factory=time.monotonic)
    done: threading.Event = field(default_factory=threading.Event)
    answer: Answer | None = None
    error: BaseException | None = None

    def run(self, ask: Callable[[], Answer]) -> None:
        try:
            self.answer = ask()
        except BaseException as error:  # noqa: BLE001 - the caller raises it
            self.error = error
        finally:
            self.done.set()


class Deadline(Generic[Answer]):
    """Asks on a thread of its own, so that a call that hangs holds nobody up.

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
        call = _Call[Answer]()
        thread = threading.Thread(target=call.run, args=(question,), name="planner", daemon=True)
        thread.start()
        self._last = call
        if not call.done.wait(self._seconds):
            raise PlannerError(f"no answer within {self._seconds:g} s")
        if isinstance(call.error, Exception):
            raise call.error
        if call.error is not None or call.answer is None:
            raise PlannerError(f"no answer: {call.error!r}")
        return call.answer
