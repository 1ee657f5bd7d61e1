"""How training tells what it does: who is told, and when."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol

from lightning_fabric import Fabric

from model_zoo.training.meter import Stopwatch
from model_zoo.training.state import EpochRecord, TrainingState


@dataclass(frozen=True)
class StepReport:
    """Where a training is.

    Attributes:
        step: Steps done.
        steps: Of the whole training.
        epoch: The epoch under way, from 0.
        loss: Mean over the epoch so far.
        samples_per_s: Training rows a second, of all ranks.
        data_wait_share: Share of the time spent waiting for batches.
        seconds_left: At the pace so far, if it does not stop early.
    """

    step: int
    steps: int
    epoch: int
    loss: float
    samples_per_s: float
    data_wait_share: float
    seconds_left: float


class TrainingProgress(Protocol):
    """Is told how a training goes."""

    def start(self, what: str, steps: int, done: int) -> None:
        """A training of so many steps begins, or goes on after some."""

    def step(self, report: StepReport) -> None:
        """Some steps more are done; told every second or so."""

    def aside(self, what: str, done: int, of: int) -> None:
        """So much of something beside the steps is done, as of a look at all rows."""

    def epoch(self, record: EpochRecord, best: bool) -> None:
        """An epoch is done, and is the best so far or not."""

    def finish(self, why: str) -> None:
        """The training is over."""


class SilentProgress:
    """Tells nobody."""

    def start(self, what: str, steps: int, done: int) -> None:
        """Ignore it."""

    def step(self, report: StepReport) -> None:
        """Ignore it."""

    def aside(self, what: str, done: int, of: int) -> None:
        """Ignore it."""

    def epoch(self, record: EpochRecord, best: bool) -> None:
        """Ignore it."""

    def finish(self, why: str) -> None:
        """Ignore it."""


REPORT_EVERY_S = 1.0


class Reporter:
    """Reports steps now and then, epochs always, from rank 0 alone."""

    def __init__(
        self, fabric: Fabric, progress: TrainingProgress, state: TrainingState, steps: int
    ) -> None:
        """Begin the clock of the time left.

        Args:
            fabric: The ranks and loggers.
            progress: Is told.
            state: Of the training, changed by it.
            steps: Of the whole training.
        """
        self._fabric, self._progress, self._state, self._steps = fabric, progress, state, steps
        self._before = state.step
        self._started = self._reported = time.monotonic()

    def step(self, watch: Stopwatch) -> None:
        """A step is done: tell it if the last report is old enough, or it is the last step.

        Raises:
            ZooError: The training has diverged.
        """
        now, state = time.monotonic(), self._state
        if now - self._reported < REPORT_EVERY_S and state.step < self._steps:
            return
        self._reported = now
        means = state.means.means()
        pace = (now - self._started) / (state.step - self._before)
        rate = self.rate(watch)
        report = StepReport(
            step=state.step,
            steps=self._steps,
            epoch=len(state.history),
            loss=means["loss"],
            samples_per_s=rate,
            data_wait_share=watch.wait_share,
            seconds_left=pace * (self._steps - state.step),
        )
        if self._fabric.is_global_zero:
            self._progress.step(report)
        self._log("step", means | {"samples_per_s": rate, "data_wait_share": watch.wait_share})

    def epoch(self, record: EpochRecord, best: bool) -> None:
        """An epoch is done."""
        if self._fabric.is_global_zero:
            self._progress.epoch(record, best)
        shown = record.model_dump(exclude={"epoch", "step", "means"})
        self._log("epoch", {**shown, **record.means})

    def rate(self, watch: Stopwatch) -> float:
        """Training rows a second, of all ranks."""
        return watch.rate * self._fabric.world_size

    def _log(self, kind: str, values: Mapping[str, float]) -> None:
        if self._fabric.loggers:
            scalars = {f"{kind}/{name}": value for name, value in values.items()}
            self._fabric.log_dict(scalars, step=self._state.step)
