"""Progress of long work: a bar with rate and time left on a terminal, plain lines in a pipe."""

from __future__ import annotations

import time
from typing import Self

from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    TaskID,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)
from rich.progress import Progress as Bar


class ConsoleProgress:
    """A bar on a terminal; otherwise one line a unit, with rate and time left."""

    def __init__(self, console: Console) -> None:
        """Write to a console."""
        self._console = console
        self._bar = Bar(
            TextColumn("{task.description}"),
            BarColumn(),
            MofNCompleteColumn(),
            TextColumn("{task.fields[rate]}"),
            TimeElapsedColumn(),
            TimeRemainingColumn(),
            console=console,
            disable=not console.is_terminal,
        )
        self._task: TaskID | None = None
        self._what, self._total, self._done, self._since = "", 0, 0, time.monotonic()

    def start(self, what: str, total: int) -> None:
        """Begin a phase."""
        self._what, self._total, self._done, self._since = what, total, 0, time.monotonic()
        self._task = self._bar.add_task(what, total=total, rate="")

    def advance(self, message: str) -> None:
        """Show one unit done."""
        self._done += 1
        seconds = max(time.monotonic() - self._since, 1e-9)
        rate = f"{self._done / seconds:.2f} {self._what}/s"
        if self._task is not None:
            self._bar.update(self._task, advance=1, rate=rate)
        if self._console.is_terminal:
            self._bar.console.print(message, highlight=False, markup=False)
        else:
            left = (self._total - self._done) * seconds / self._done
            line = f"[{self._what} {self._done}/{self._total}, {rate}, {left:.0f} s left] {message}"
            self._console.print(line, highlight=False, markup=False, soft_wrap=True)

    def __enter__(self) -> Self:
        """Show the bar."""
        self._bar.start()
        return self

    def __exit__(self, *error: object) -> None:
        """Take the bar away."""
        self._bar.stop()
