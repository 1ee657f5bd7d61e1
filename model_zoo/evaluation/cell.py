"""Scores of one scenario under one condition of the sensors, as an evaluation's file has them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Self

import numpy as np
from pydantic import Field, model_validator

from graspe_data.manifest import Settings
from model_zoo.evaluation.parts import ALL_ROWS, NOT_FAILING

ALL_SCENARIOS = "all"
"""Stands for the rows of all scenarios together."""

ROC_POINTS = 201
"""Of a ROC curve: the same for all, so that their mean is one."""

AREA_APART = 0.02
"""A curve of 201 points rounds the corners off."""

_ROUNDING = 1e-6

Share = Annotated[float, Field(ge=-_ROUNDING, le=1 + _ROUNDING)]
"""Every score that is stored lies in 0 .. 1, but for rounding."""
Count = Annotated[int, Field(ge=1)]


class Score(Settings):
    """A score and the interval that 95 % of the resamples lie in; None where not defined."""

    value: float | None
    low: float | None
    high: float | None

    @model_validator(mode="after")
    def _check_interval(self) -> Self:
        if (self.low is None) != (self.high is None):
            raise ValueError(f"low {self.low}, high {self.high}: expected both or none")
        if self.low is not None and self.high is not None and self.low > self.high:
            raise ValueError(f"low {self.low} is above high {self.high}")
        return self


class StoredScore(Score):
    """A score of a model, and no difference of two."""

    value: Share | None
    low: Share | None
    high: Share | None


class RocCurve(Settings):
    """Share of successes accepted against share of failures accepted, from (0, 0) to (1, 1)."""

    false_positive: Annotated[
        tuple[Share, ...], Field(min_length=ROC_POINTS, max_length=ROC_POINTS)
    ]
    true_positive: Annotated[tuple[Share, ...], Field(min_length=ROC_POINTS, max_length=ROC_POINTS)]


class CalibrationCurve(Settings):
    """Of each bin of probability that has judged steps: mean probability, successes, steps."""

    probability: tuple[Share, ...]
    success: tuple[Share, ...]
    judged: tuple[Count, ...]

    @model_validator(mode="after")
    def _check_lengths(self) -> Self:
        lengths = len(self.probability), len(self.success), len(self.judged)
        if len(set(lengths)) > 1:
            raise ValueError(
                f"probability, success and judged have {lengths} bins, expected as many in each"
            )
        return self


class Lead(Score):
    """How far an AU-ROC lies above the best blind reference's, on the same resamples.

    Attributes:
        reference: The reference with the highest AU-ROC there.
    """

    reference: str


class Part(Settings):
    """The AU-ROC of some of a cell's rows.

    Attributes:
        rows: With a judged step in the part; of a time to failure those that fail in it; within a
            scene, those whose candidates do not all end alike.
        judged: Their judged steps in the part; within a scene, their candidates.
        au_roc: Of these steps; within a scene, its mean over the rows.
        resamples: AU-ROC of every resample of recordings; the same resamples for every model and
            reference, so that differences can be judged pair by pair. Empty for too few recordings.
        lead: Of a model, over the best blind reference.
    """

    rows: Annotated[int, Field(ge=0)]
    judged: Annotated[int, Field(ge=0)]
    au_roc: StoredScore
    resamples: tuple[Share | None, ...]
    lead: Lead | None = None


class ReferenceCell(Settings):
    """One scenario under one condition, of a blind reference; see :class:`Cell`."""

    scenario: str
    condition: str
    parts: Mapping[str, Part]


class Cell(Settings):
    """One scenario under one condition of the sensors; all but ``parts`` of rows not failing yet.

    Attributes:
        scenario: The group of the recordings, or ``all``.
        condition: What was done to the observations.
        recordings: Recordings in it.
        rows: Their rows that are not failing yet.
        judged: Judged steps of these rows.
        success_share: Of the judged steps.
        scores: By the name of the function in :mod:`model_zoo.metrics`.
        resamples: Of some other scores, as those of a part.
        parts: By their names, see :mod:`model_zoo.evaluation.parts`; ``not_failing`` is the primary
            one, whose AU-ROC stands among the scores too.
        roc: Of the judged steps, pooled; None where one class alone was judged.
        calibration: Of the judged steps, pooled.
    """

    scenario: str
    condition: str
    recordings: Count
    rows: Annotated[int, Field(ge=0)]
    judged: Annotated[int, Field(ge=0)]
    success_share: Share | None
    scores: Mapping[str, StoredScore]
    resamples: Mapping[str, tuple[Share | None, ...]] = {}
    parts: Mapping[str, Part]
    roc: RocCurve | None
    calibration: CalibrationCurve

    @model_validator(mode="after")
    def _check_scores(self) -> Self:
        if "au_roc" not in self.scores:
            found = ", ".join(self.scores) or "none"
            raise ValueError(f"scores: expected au_roc among them, found {found}")
        missing = [name for name in (NOT_FAILING, ALL_ROWS) if name not in self.parts]
        if missing:
            raise ValueError(f"parts: expected {', '.join(missing)} among them")
        if self.parts[NOT_FAILING].au_roc != self.scores["au_roc"]:
            raise ValueError(f"parts: au_roc of {NOT_FAILING} is not that among the scores")
        self._check_area()
        steps = sum(self.calibration.judged)
        if steps != self.judged:
            raise ValueError(f"calibration: has {steps} judged steps, the cell {self.judged}")
        return self

    def _check_area(self) -> None:
        """The AU-ROC is the area under the curve that is stored beside it."""
        value = self.scores["au_roc"].value
        if value is None or self.roc is None:
            return
        widths = np.diff(self.roc.false_positive)
        heights = np.array(self.roc.true_positive)
        area = float(np.sum(widths * (heights[1:] + heights[:-1]) / 2))
        if abs(area - value) > AREA_APART:
            raise ValueError(f"au_roc is {value:.4g}, the area under its curve is {area:.4g}")

    @property
    def only_class(self) -> str | None:
        """Why AU-ROC is not defined where the judged steps are of one class; else None."""
        reasons = {1.0: "all judged steps succeed", 0.0: "all judged steps fail"}
        if self.success_share is None:
            return "a failure is under way in every judged row"
        return reasons.get(self.success_share)
