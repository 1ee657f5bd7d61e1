"""Two methods on the same seeds: who arrived where the other did not."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import comb

from pipelines.trials.results import TrialGroup


@dataclass(frozen=True)
class PairedTrials:
    """The trials of two methods in the same worlds.

    Attributes:
        seeds: Worlds that both drove in.
        won: Those in which the first alone arrived.
        lost: Those in which the other alone did.
    """

    seeds: int
    won: int
    lost: int

    @property
    def gain(self) -> float | None:
        """By how much more often the first arrived, as a share of the seeds; None without any."""
        return (self.won - self.lost) / self.seeds if self.seeds else None

    @property
    def p_value(self) -> float:
        """Of McNemar's exact test, two-sided.

        The chance that as many or more of the worlds that tell the two apart would fall to one of
        them, were both as likely to arrive there.
        """
        apart = self.won + self.lost
        tail = sum(comb(apart, count) for count in range(min(self.won, self.lost) + 1))
        return float(min(1.0, 2 * tail / 2**apart))


def pair_trials(one: Sequence[TrialGroup], other: Sequence[TrialGroup]) -> PairedTrials:
    """Pair the trials of two methods by scenario and seed.

    Args:
        one: Cells of the first method, of as many scenarios as are taken together.
        other: Of the second.
    """
    mine, theirs = (
        {(trial.scenario, trial.seed): trial.success for cell in cells for trial in cell.trials}
        for cells in (one, other)
    )
    both = mine.keys() & theirs.keys()
    return PairedTrials(
        len(both),
        sum(mine[key] and not theirs[key] for key in both),
        sum(theirs[key] and not mine[key] for key in both),
    )
