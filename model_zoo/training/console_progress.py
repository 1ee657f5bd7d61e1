"""Progress of a training on a console: a bar on a terminal, plain lines in a pipe."""

from __future__ import annotations

import time
from typing import Self

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TaskID, TextColumn

from model_zoo.training.history import EpochRecord
from model_zoo.training.progress import StepReport

SECONDS_BETWEEN_LINES = 30.0


class ConsoleTrainingProgress:
    """Shows steps, rate, loss and time left; a line for every epoch."""

    def __init__(self, console: Console, line_every_s: float = SECONDS_BETWEEN_LINES) -> None:
        """Write to a console; in a pipe at most one line of steps in ``line_every_s`` seconds."""
        self._console = console
        self._line_every_s = line_every_s
        self._last_line = time.monotonic()
        self._bar = Progress(
            TextColumn("{task.description}"),
            BarColumn(),
            MofNCompleteColumn(),
            TextColumn("{task.fields[state]}"),
            console=console,
            disable=not console.is_terminal,
        )
        self._task: TaskID | None = None
        self._aside: TaskID | None = None

    def start(self, what: str, steps: int, done: int) -> None:
        """Begin a bar."""
        self._task = self._bar.add_task(what, total=steps, completed=done, state="")
        self._print(f"{what}: " + (f"goes on at step {done}" if done else "begins"))

    def step(self, report: StepReport) -> None:
        """Move the bar, or write a line if the last is old enough."""
        text = (
            f"epoch {report.epoch}  loss {report.loss:.4f}  {report.samples_per_s:.1f} samples/s  "
            f"waiting for data {report.data_wait_share:.1%}  {_duration(report.seconds_left)} left"
        )
        if self._task is not None:
            self._bar.update(self._task, completed=report.step, state=text)
        self._line_now_and_then(f"[step {report.step}/{report.steps}] {text}")

    def aside(self, what: str, done: int, of: int) -> None:
        """Show a second bar until all is done, or write a line if the last is old enough."""
        if self._aside is None:
            self._aside = self._bar.add_task(what, total=of, state="")
        self._bar.update(self._aside, completed=done)
        if done >= of:
            self._bar.remove_task(self._aside)
            self._aside = None
        self._line_now_and_then(f"[{what} {done}/{of}]")

    def epoch(self, record: EpochRecord, best: bool) -> None:
        """Write the epoch's line."""
        self._print(
            f"epoch {record.epoch}: loss {record.means['loss']:.4f}, validation AU-ROC "
            f"{record.au_roc:.4f}{' (best)' if best else ''}, {record.samples_per_s:.1f} "
            f"samples/s, waited for data {record.data_wait_share:.1%}, {record.seconds:.0f} s"
        )

    def finish(self, why: str) -> None:
        """Write why it is over."""
        self._print(why)

    def __enter__(self) -> Self:
        """Show the bar."""
        self._bar.start()
        return self

    def __exit__(self, *error: object) -> None:
        """Take the bar away."""
        self._bar.stop()

    def _line_now_and_then(self, line: str) -> None:
        now = time.monotonic()
        if not self._console.is_terminal and now - self._last_line >= self._line_every_s:
            self._last_line = now
            self._print(line)

    def _print(self, line: str) -> None:
        console = self._bar.console
        console.print(line, highlight=False, markup=False, soft_wrap=True)


def _duration(seconds: float) -> str:
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02d}:{rest:02d}" if hours else f"{minutes}:{rest:02d}"
