"""Tells progress and TensorBoard how a training goes."""

from __future__ import annotations

import time
from collections.abc import Mapping

from lightning_fabric import Fabric

from model_zoo.training.history import EpochRecord
from model_zoo.training.meter import Stopwatch
from model_zoo.training.progress import StepReport, TrainingProgress
from model_zoo.training.state import TrainingState

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
        self._started = self._told = time.monotonic()

    def step(self, watch: Stopwatch) -> None:
        """A step is done: tell it if the last report is old enough, or it is the last step.

        Raises:
            ZooError: The training has diverged.
        """
        now, state = time.monotonic(), self._state
        if now - self._told < REPORT_EVERY_S and state.step < self._steps:
            return
        self._told = now
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
            named = {f"{kind}/{name}": value for name, value in values.items()}
            self._fabric.log_dict(named, step=self._state.step)
