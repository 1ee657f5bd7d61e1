"""Progress of long work: a bar with rate and time left on a terminal, plain lines in a pipe."""

from __future__ import annotations

import time
from typing import Self

from rich.console import Console as RichConsole
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    ProgressColumn,
    TaskID,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)
from rich.progress import Progress as Bar


class Console:
    """A bar on a terminal, in which lines are written above it; in a pipe lines alone."""

    def __init__(self, console: RichConsole, *columns: ProgressColumn | str) -> None:
        """Write to a console.

        Args:
            console: Where.
            columns: What stands right of the name and the bar.
        """
        self.is_terminal = console.is_terminal
        self.bar = Bar(
            TextColumn("{task.description}"),
            BarColumn(),
            MofNCompleteColumn(),
            *columns,
            console=console,
            disable=not console.is_terminal,
        )

    def print(self, line: str) -> None:
        """Write a line as it is, however long."""
        self.bar.console.print(line, highlight=False, markup=False, soft_wrap=True)

    def __enter__(self) -> Self:
        """Show the bar."""
        self.bar.start()
        return self

    def __exit__(self, *error: object) -> None:
        """Take the bar away."""
        self.bar.stop()


class ConsoleProgress(Console):
    """A bar on a terminal; otherwise one line a unit, with rate and time left."""

    def __init__(self, console: RichConsole) -> None:
        """Write to a console."""
        rate = TextColumn("{task.fields[rate]}")
        super().__init__(console, rate, TimeElapsedColumn(), TimeRemainingColumn())
        self._task: TaskID | None = None
        self._what, self._total, self._done, self._since = "", 0, 0, time.monotonic()

    def start(self, what: str, total: int) -> None:
        """Begin a phase."""
        self._what, self._total, self._done, self._since = what, total, 0, time.monotonic()
        self._task = self.bar.add_task(what, total=total, rate="")

    def advance(self, message: str) -> None:
        """Show one unit done."""
        self._done += 1
        seconds = max(time.monotonic() - self._since, 1e-9)
        rate = f"{self._done / seconds:.2f} {self._what}/s"
        if self._task is not None:
            self.bar.update(self._task, advance=1, rate=rate)
        if self.is_terminal:
            self.print(message)
        else:
            left = (self._total - self._done) * seconds / self._done
            self.print(
                f"[{self._what} {self._done}/{self._total}, {rate}, {left:.0f} s left] {message}"
            )
