"""How training tells what it does."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from model_zoo.training.history import EpochRecord


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
