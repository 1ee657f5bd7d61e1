"""What an evaluation found, and its file."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Literal

from graspe_data.atomic_file import write_atomically
from graspe_data.errors import ManifestError, ZooError
from graspe_data.manifest import Settings, validate
from graspe_data.shards.dataset_manifest import canonical_json
from model_zoo.evaluation.latency import Latency

ALL_SCENARIOS = "all"
"""Stands for the rows of all scenarios together."""

_LARGEST = 256 << 20


class Score(Settings):
    """A score and the interval that 95 % of the resamples lie in; None where not defined."""

    value: float | None
    low: float | None
    high: float | None


class RocCurve(Settings):
    """Share of successes accepted against share of failures accepted, from (0, 0) to (1, 1)."""

    false_positive: tuple[float, ...]
    true_positive: tuple[float, ...]


class CalibrationCurve(Settings):
    """Of each bin of probability that has judged steps: mean probability, successes, steps."""

    probability: tuple[float, ...]
    success: tuple[float, ...]
    judged: tuple[int, ...]


class Cell(Settings):
    """One scenario under one condition of the sensors.

    Attributes:
        scenario: The group of the recordings, or ``all``.
        condition: What was done to the observations.
        recordings: Recordings in it.
        rows: Their rows.
        judged: Judged steps of these rows.
        success_share: Of the judged steps.
        scores: By the name of the function in :mod:`model_zoo.evaluation.metrics`.
        au_roc_resamples: AU-ROC of every resample; the same resamples for every model, so that
            differences between models can be judged pair by pair.
        roc: Of the judged steps, pooled; None where one class alone was judged.
        calibration: Of the judged steps, pooled.
    """

    scenario: str
    condition: str
    recordings: int
    rows: int
    judged: int
    success_share: float | None
    scores: Mapping[str, Score]
    au_roc_resamples: tuple[float | None, ...]
    roc: RocCurve | None
    calibration: CalibrationCurve


class Evaluation(Settings):
    """Scores of one checkpoint on one split.

    Attributes:
        format: Version of the file.
        model: Name of the model.
        preset: Its preset.
        seed: Of the training, where the recipe has one.
        parameters: Numbers in the model.
        checkpoint: Digest of the checkpoint.
        trained_on: Digest of the dataset it was trained on.
        dataset: Digest of the dataset of this evaluation.
        split: The split.
        temperature: Of the calibration; None where there is none.
        resamples: Of recordings, for the intervals.
        resample_seed: Seed of the resamples and of the degradations.
        every: Of the judged rows of a recording, every so many were taken.
        cells: Every scenario and all together, under every condition.
        latency: Of one prediction.
    """

    format: Literal["graspe-evaluation-1"] = "graspe-evaluation-1"
    model: str
    preset: str
    seed: int | None
    parameters: int
    checkpoint: str
    trained_on: str
    dataset: str
    split: str
    temperature: float | None
    resamples: int
    resample_seed: int
    every: int = 1
    cells: tuple[Cell, ...]
    latency: Latency

    def cell(self, scenario: str = ALL_SCENARIOS, condition: str = "clean") -> Cell | None:
        """The cell of a scenario and a condition; None where there is none."""
        found = (c for c in self.cells if (c.scenario, c.condition) == (scenario, condition))
        return next(found, None)

    @property
    def scenarios(self) -> tuple[str, ...]:
        """The scenarios, without ``all``, in order."""
        names = dict.fromkeys(cell.scenario for cell in self.cells)
        return tuple(name for name in names if name != ALL_SCENARIOS)

    @property
    def conditions(self) -> tuple[str, ...]:
        """The conditions, in order."""
        return tuple(dict.fromkeys(cell.condition for cell in self.cells))

    def write(self, path: Path) -> None:
        """Write it as JSON, atomically.

        Raises:
            ZooError: The file cannot be written.
        """
        text = canonical_json(self.model_dump(mode="json"), indent=None) + "\n"
        write_atomically(path, [text.encode()], ZooError)


def read_evaluation(path: Path) -> Evaluation:
    """Read the file of an evaluation.

    Raises:
        ZooError: It is missing, not JSON, or no evaluation; each fault with its key.
    """
    try:
        if path.stat().st_size > _LARGEST:
            raise ZooError(f"{path}: larger than {_LARGEST} bytes, so no evaluation.")
        content = json.loads(path.read_bytes())
        if not isinstance(content, dict):
            raise ZooError(f"{path}: expected a mapping, found {type(content).__name__}.")
        return validate(content, Evaluation, str(path))
    except OSError as error:
        raise ZooError(
            f"{path}: cannot be read: {error.strerror}. Run `graspe zoo evaluate` first."
        ) from error
    except (ValueError, RecursionError) as error:
        raise ZooError(f"{path}: not valid JSON: {error}. Evaluate again.") from error
    except ManifestError as error:
        raise ZooError(f"{error}\nEvaluate again.") from error
