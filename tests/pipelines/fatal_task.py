"""A task for executors; importable by workers."""

from __future__ import annotations

import os
import signal


def fatal_for_three(number: int) -> int:
    """The square of a number; 3 kills the process, as a memory killer does."""
    if number == 3:
        os.kill(os.getpid(), signal.SIGKILL)
    return number * number
