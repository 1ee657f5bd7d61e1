"""Progress of a training on a console: a bar on a terminal, plain lines in a pipe."""

from __future__ import annotations

import time

from rich.console import Console as RichConsole
from rich.progress import TaskID, TextColumn

from model_zoo.training.progress import StepReport
from model_zoo.training.state import EpochRecord
from pipelines.progress import Console

SECONDS_BETWEEN_LINES = 30.0


class ConsoleTrainingProgress(Console):
    """Shows steps, rate, loss and time left; a line for every epoch."""

    def __init__(self, console: RichConsole, line_every_s: float = SECONDS_BETWEEN_LINES) -> None:
        """Write to a console; in a pipe at most one line of steps in ``line_every_s`` seconds."""
        super().__init__(console, TextColumn("{task.fields[state]}"))
        self._line_every_s = line_every_s
        self._last_line = time.monotonic()
        self._task: TaskID | None = None
        self._aside: TaskID | None = None

    def start(self, what: str, steps: int, done: int) -> None:
        """Begin a bar."""
        self._task = self.bar.add_task(what, total=steps, completed=done, state="")
        self.print(f"{what}: " + (f"goes on at step {done}" if done else "begins"))

    def step(self, report: StepReport) -> None:
        """Move the bar, or write a line if the last is old enough."""
        text = (
            f"epoch {report.epoch}  loss {report.loss:.4f}  {report.samples_per_s:.1f} samples/s  "
            f"waiting for data {report.data_wait_share:.1%}  {_duration(report.seconds_left)} left"
        )
        if self._task is not None:
            self.bar.update(self._task, completed=report.step, state=text)
        self._line_now_and_then(f"[step {report.step}/{report.steps}] {text}")

    def aside(self, what: str, done: int, of: int) -> None:
        """Show a second bar until all is done, or write a line if the last is old enough."""
        if self._aside is None:
            self._aside = self.bar.add_task(what, total=of, state="")
        self.bar.update(self._aside, completed=done)
        if done >= of:
            self.bar.remove_task(self._aside)
            self._aside = None
        self._line_now_and_then(f"[{what} {done}/{of}]")

    def epoch(self, record: EpochRecord, best: bool) -> None:
        """Write the epoch's line."""
        self.print(
            f"epoch {record.epoch}: loss {record.means['loss']:.4f}, validation AU-ROC "
            f"{record.au_roc:.4f}{' (best)' if best else ''}, {record.samples_per_s:.1f} "
            f"samples/s, waited for data {record.data_wait_share:.1%}, {record.seconds:.0f} s"
        )

    def finish(self, why: str) -> None:
        """Write why it is over."""
        self.print(why)

    def _line_now_and_then(self, line: str) -> None:
        now = time.monotonic()
        if not self.is_terminal and now - self._last_line >= self._line_every_s:
            self._last_line = now
            self.print(line)


def _duration(seconds: float) -> str:
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02d}:{rest:02d}" if hours else f"{minutes}:{rest:02d}"
