"""Who stands in a table of scores: a blind reference, or a model with its trainings."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from statistics import fmean
from typing import Protocol

import numpy as np

from graspe_data.arrays import Floats
from model_zoo.evaluation.blind_references import References, as_array, difference
from model_zoo.evaluation.bootstrap import joint_resamples
from model_zoo.evaluation.cell import ALL_SCENARIOS, Lead, Part, Score
from model_zoo.evaluation.parts import NOT_FAILING
from model_zoo.evaluation.score_cells import interval

UNDEFINED = Score(value=None, low=None, high=None)


class _Cell(Protocol):
    @property
    def parts(self) -> Mapping[str, Part]: ...


class Scored(Protocol):
    """One training's evaluation, or a reference's scores."""

    def cell(self, scenario: str = ..., condition: str = ...) -> _Cell | None:
        """Its scores in a place."""


@dataclass(frozen=True)
class Entrant:
    """A row of a table.

    Attributes:
        label: How tables and plots call it.
        scored: Scores of each of its trainings.
        seed: Of the draws of trainings; the same in every place, another for every entrant.
    """

    label: str
    scored: Sequence[Scored]
    seed: int

    def au_roc(self, scenario: str, condition: str, part: str = NOT_FAILING) -> Score:
        """The mean over the trainings, and the interval over trainings and recordings together."""
        parts = self._parts(scenario, condition, part)
        if len(self.scored) == len(parts) == 1:
            return Score(**parts[0].au_roc.model_dump())
        value = self._value(scenario, condition, part)
        low, high = interval(self.resampled(scenario, condition, part))
        if value is None:
            return UNDEFINED
        return Score(value=value, low=low, high=high)

    def resampled(self, scenario: str, condition: str, part: str) -> Floats:
        """AU-ROC of every resample of trainings and recordings, (S,); empty where there is none."""
        drawn = [as_array(p.resamples) for p in self._parts(scenario, condition, part)]
        if len(drawn) < len(self.scored) or len({d.size for d in drawn}) > 1:
            return np.zeros(0)
        return joint_resamples(np.array(drawn), self.seed)

    def advantage(
        self, other: Entrant, scenario: str, condition: str, part: str = NOT_FAILING
    ) -> Score:
        """AU-ROC of this one less that of another, over the same resamples of recordings."""
        place = (scenario, condition, part)
        return difference(
            (self._value(*place), self.resampled(*place)),
            (other._value(*place), other.resampled(*place)),
        )

    def decline(
        self,
        clean: str,
        condition: str,
        scenario: str = ALL_SCENARIOS,
        part: str = NOT_FAILING,
    ) -> Score:
        """AU-ROC under one condition less that under another, over the same resamples."""
        before, after = (scenario, clean, part), (scenario, condition, part)
        return difference(
            (self._value(*before), self.resampled(*before)),
            (self._value(*after), self.resampled(*after)),
        )

    def lead(
        self, references: References, scenario: str, condition: str, part: str = NOT_FAILING
    ) -> Lead | None:
        """AU-ROC less that of the best blind reference there; None where one is not defined."""
        best = references.best(part, scenario, condition)
        if best is None:
            return None
        name, blind = best
        place = (scenario, condition, part)
        found = difference(
            (self._value(*place), self.resampled(*place)),
            (blind.au_roc.value, as_array(blind.resamples)),
        )
        return None if found.value is None else Lead(reference=name, **found.model_dump())

    def _value(self, scenario: str, condition: str, part: str) -> float | None:
        values = [found.au_roc.value for found in self._parts(scenario, condition, part)]
        known = [value for value in values if value is not None]
        return fmean(known) if known and len(known) == len(self.scored) else None

    def _parts(self, scenario: str, condition: str, part: str) -> list[Part]:
        cells = [scored.cell(scenario, condition) for scored in self.scored]
        return [cell.parts[part] for cell in cells if cell is not None and part in cell.parts]


def blind_entrants(references: References) -> list[Entrant]:
    """The references, in the order of tables; each was taught once."""
    return [Entrant(reference.title, (reference,), 0) for reference in references.scores]
