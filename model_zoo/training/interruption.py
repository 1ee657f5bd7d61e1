"""Ctrl-C between two steps, never within one."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType


class Interruption:
    """Lets Ctrl-C raise ``KeyboardInterrupt`` at once, or at the end of what must not be halved.

    Whoever handles SIGINT otherwise, or trains in a thread, keeps their own way.

    Attributes:
        halved: Whether something that was held did not come to its end.
    """

    def __init__(self) -> None:
        """Nothing is held, nothing was asked."""
        self._holding = self._interrupted = self.halved = False

    @contextmanager
    def listening(self) -> Iterator[None]:
        """Take over SIGINT from Python."""
        ours = threading.current_thread() is threading.main_thread()
        if not ours or signal.getsignal(signal.SIGINT) is not signal.default_int_handler:
            yield
            return
        signal.signal(signal.SIGINT, self._ask)
        try:
            yield
        finally:
            signal.signal(signal.SIGINT, signal.default_int_handler)

    @contextmanager
    def held(self) -> Iterator[None]:
        """Put a first Ctrl-C off until the end; a second one does not wait.

        Raises:
            KeyboardInterrupt: It was asked for meanwhile.
        """
        self._holding = self.halved = True
        try:
            yield
            self.halved = False
        finally:
            self._holding = False
        if self._interrupted:
            raise KeyboardInterrupt

    def _ask(self, _number: int, _frame: FrameType | None) -> None:
        if not self._holding or self._interrupted:
            raise KeyboardInterrupt
        self._interrupted = True
