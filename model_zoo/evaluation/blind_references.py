"""Scores of the blind references, and how far a model lies above the best of them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Self

import numpy as np
from pydantic import model_validator

from graspe_data.arrays import Floats
from graspe_data.manifest import Settings
from graspe_data.progress import Progress
from model_zoo.augmentation import Condition
from model_zoo.evaluation.blind_features import ALWAYS, REFERENCES, TITLES
from model_zoo.evaluation.blind_predictions import predict_blind
from model_zoo.evaluation.cell import ALL_SCENARIOS, Cell, Lead, Part, ReferenceCell, Score
from model_zoo.evaluation.judged_split import JudgedSplit
from model_zoo.evaluation.score_cells import Said, interval, score_reference


class ReferenceScores(Settings):
    """What a blind reference scores on the rows of an evaluation.

    Attributes:
        name: One of the references.
        cells: Every scenario and all together, under the first condition; under others only where
            they change what it reads.
    """

    name: str
    cells: tuple[ReferenceCell, ...]

    @property
    def title(self) -> str:
        """For people."""
        return TITLES.get(self.name, self.name)

    def cell(self, scenario: str = ALL_SCENARIOS, condition: str = "clean") -> ReferenceCell | None:
        """The cell of a scenario; of another condition where that changes nothing."""
        found = [cell for cell in self.cells if cell.scenario == scenario]
        same = [cell for cell in found if cell.condition == condition]
        return next(iter(same or found), None)


class References(Settings):
    """All blind references of an evaluation.

    Attributes:
        taught_on: Digest of the dataset whose rows taught them and chose their settings.
        scores: In the order of tables.
    """

    taught_on: str
    scores: tuple[ReferenceScores, ...]

    @model_validator(mode="after")
    def _none_is_left_out(self) -> Self:
        found = [reference.name for reference in self.scores]
        missing = [name for name in ALWAYS if name not in found]
        unknown = [name for name in found if name not in REFERENCES]
        if missing or unknown or len(set(found)) < len(found):
            raise ValueError(
                f"expected the blind references {', '.join(ALWAYS)}, found "
                f"{', '.join(found) or 'none'}; no score is shown without them"
            )
        return self

    def best(self, part: str, scenario: str, condition: str) -> tuple[str, Part] | None:
        """The name and scores of the reference with the highest AU-ROC in a place."""
        found = [
            (reference.name, cell.parts[part])
            for reference in self.scores
            if (cell := reference.cell(scenario, condition)) and part in cell.parts
        ]
        known = [one for one in found if one[1].au_roc.value is not None]
        return max(known, key=lambda one: one[1].au_roc.value or 0.0, default=None)


def score_references(
    split: JudgedSplit,
    teach: Path,
    taught_on: str,
    conditions: Sequence[Condition],
    resamples: int,
    seed: int,
    progress: Progress,
) -> References:
    """Teach the references and score them on the rows of a split.

    Args:
        split: The rows.
        teach: The dataset whose rows teach.
        taught_on: Its digest.
        conditions: Of the evaluation.
        resamples: Of recordings.
        seed: Of degradations and resamples.
        progress: Is told of every reference that is taught.

    Raises:
        ZooError: As :func:`predict_blind`.
    """
    cells: dict[str, list[ReferenceCell]] = {}
    for said in predict_blind(split, teach, conditions, seed, progress):
        scored = score_reference(
            split, Said(said.log_odds, said.candidates), said.condition, resamples, seed
        )
        cells.setdefault(said.name, []).extend(scored)
    scores = [ReferenceScores(name=name, cells=tuple(found)) for name, found in cells.items()]
    return References(taught_on=taught_on, scores=tuple(scores))


def with_leads(cell: Cell, references: References) -> Cell:
    """A model's cell, each part with its lead over the best reference there."""
    parts = {
        name: part.model_copy(update={"lead": _lead(part, references, name, cell)})
        for name, part in cell.parts.items()
    }
    return cell.model_copy(update={"parts": parts})


def _lead(part: Part, references: References, name: str, cell: Cell) -> Lead | None:
    best = references.best(name, cell.scenario, cell.condition)
    if best is None or part.au_roc.value is None:
        return None
    reference, blind = best
    found = difference(
        (part.au_roc.value, as_array(part.resamples)),
        (blind.au_roc.value, as_array(blind.resamples)),
    )
    return Lead(reference=reference, **found.model_dump())


def as_array(resamples: Sequence[float | None]) -> Floats:
    """Resampled scores, NaN where there is none."""
    return np.array(resamples, dtype=np.float64)


def difference(one: tuple[float | None, Floats], other: tuple[float | None, Floats]) -> Score:
    """One score less another, over the same resamples; None where one is not defined."""
    if one[0] is None or other[0] is None:
        return Score(value=None, low=None, high=None)
    paired = one[1].shape == other[1].shape
    low, high = interval(one[1] - other[1]) if paired else (None, None)
    return Score(value=one[0] - other[0], low=low, high=high)
