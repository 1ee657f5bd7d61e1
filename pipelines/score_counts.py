"""How well labels agree with the truth: counts of events, and of the steps of rows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import astuple, dataclass

import numpy as np
from numpy.typing import NDArray

from graspe_data.observation.labels import Event, EventKind, RowLabels

TOLERANCE_S = 0.3


@dataclass(frozen=True)
class EventScore:
    """Events of one kind: how many were proposed, how many of those right; how many true, found.

    A proposal is right, and a true event found, when one of the other side lies within
    ``TOLERANCE_S`` of it.
    """

    proposed: int = 0
    right: int = 0
    true: int = 0
    found: int = 0

    @property
    def precision(self) -> float | None:
        """Of the proposals, the right ones; None without a proposal."""
        return _share(self.right, self.proposed)

    @property
    def recall(self) -> float | None:
        """Of the true events, those found; None without one."""
        return _share(self.found, self.true)

    def __add__(self, other: EventScore) -> EventScore:
        """Both together."""
        return EventScore(*np.add(astuple(self), astuple(other)).tolist())


@dataclass(frozen=True)
class StepScore:
    """Steps of rows: how many, how many judged, and of these the counts of labels and truth."""

    steps: int = 0
    judged: int = 0
    agreeing: int = 0
    labelled_failing: int = 0
    truly_failing: int = 0
    both_failing: int = 0

    @property
    def agreement(self) -> float | None:
        """Of the judged steps, those whose label is the truth."""
        return _share(self.agreeing, self.judged)

    @property
    def precision(self) -> float | None:
        """Of the steps labelled as failing, those that truly fail."""
        return _share(self.both_failing, self.labelled_failing)

    @property
    def recall(self) -> float | None:
        """Of the judged steps that truly fail, those labelled so."""
        return _share(self.both_failing, self.truly_failing)

    def __add__(self, other: StepScore) -> StepScore:
        """Both together."""
        return StepScore(*np.add(astuple(self), astuple(other)).tolist())


def score_events(proposed: Sequence[Event], true: Sequence[Event], kind: EventKind) -> EventScore:
    """Match the events of one kind by their times."""
    ours = [event for event in proposed if event.kind == kind]
    theirs = [event for event in true if event.kind == kind]
    right = sum(_wider(event).meets(theirs) for event in ours)
    found = sum(_wider(event).meets(ours) for event in theirs)
    return EventScore(len(ours), right, len(theirs), found)


def score_steps(labels: RowLabels, truth: NDArray[np.bool_]) -> StepScore:
    """Compare labels (R, T) with the truth (R, T) where they judge."""
    mask, failing, fails = labels.mask, labels.success == 0, ~truth
    return StepScore(
        steps=mask.size,
        judged=int(mask.sum()),
        agreeing=int((mask & (failing == fails)).sum()),
        labelled_failing=int((mask & failing).sum()),
        truly_failing=int((mask & fails).sum()),
        both_failing=int((mask & failing & fails).sum()),
    )


def _wider(event: Event) -> Event:
    more = round(TOLERANCE_S * 1e9)
    return Event(event.kind, event.start_ns - more, event.stop_ns + more, event.evidence)


def _share(part: int, whole: int) -> float | None:
    return part / whole if whole else None
