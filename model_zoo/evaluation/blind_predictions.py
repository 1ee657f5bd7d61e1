"""What the blind references say of the rows that a model is examined on."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass, replace
from importlib.metadata import version
from pathlib import Path
from typing import Final, Self

import torch

from graspe_data.arrays import Floats
from graspe_data.documents import canonical_json
from graspe_data.progress import Progress
from graspe_data.shards import Dataset
from graspe_data.shards.dataset_index import read_index
from model_zoo.augmentation import FAILING_SENSOR, Condition, apply_condition
from model_zoo.augmentation.settings import settings_of_dataset
from model_zoo.evaluation.blind_cache import Arrays, kept_or_made
from model_zoo.evaluation.blind_features import LASER_SCAN, REFERENCES, SCAN, TITLES
from model_zoo.evaluation.blind_rows import (
    BlindRows,
    read_blind_rows,
    rows_to_choose,
    rows_to_teach,
)
from model_zoo.evaluation.blind_teaching import TaughtReference, teach_reference
from model_zoo.evaluation.judged_split import JudgedSplit
from model_zoo.split_leaks import check_apart

VERSION: Final = 3
"""Of what references are; another one is taught anew."""


@dataclass(frozen=True)
class BlindPrediction:
    """One reference under one condition of the sensors.

    Attributes:
        name: One of the references.
        condition: The first of the evaluation; a failing scan has its own.
        log_odds: Of success, float64 (N, T).
        candidates: Of getting through, float64 (N, K); None where rows have none.
    """

    name: str
    condition: Condition
    log_odds: Floats
    candidates: Floats | None


def predict_blind(
    split: JudgedSplit,
    teach: Path,
    conditions: Sequence[Condition],
    seed: int,
    progress: Progress,
) -> list[BlindPrediction]:
    """Teach the references and ask them about the rows of a split.

    They are taught on the training rows of ``teach``, and their settings are chosen on the half of
    its validation rows that selects. What they say is kept by the digest of all that it follows
    from.

    Args:
        split: The rows to score.
        teach: The dataset whose rows teach; the one that is evaluated, or that of the training.
        conditions: Of the evaluation.
        seed: Of the degradations.
        progress: Is told of every reference that is taught.

    Raises:
        ZooError: There are no training rows, no velocity history, or a recording of the split is
            among those that teach or choose.
    """
    index = read_index(teach)
    check_apart(index.recordings, split.dataset.index.recordings, split.name, teach)
    keys = _keys(split, conditions)
    said = {
        "version": VERSION,
        "packages": [version(name) for name in ("scikit-learn", "numpy")],
        # With the recordings' names, by which the validation is halved.
        "taught_on": index.document_digest,
        "dataset": split.dataset.digest,
        "split": split.name,
        "rows": hashlib.sha256(split.rows.tobytes()).hexdigest(),
        "asked": [list(key) for key in keys],
        "seed": seed,
    }
    digest = hashlib.sha256(canonical_json(said).encode()).hexdigest()
    found = kept_or_made(digest, lambda: _made(split, teach, keys, seed, progress))
    return [
        BlindPrediction(*key, found[_log_odds(key)], found.get(_candidates(key))) for key in keys
    ]


_Key = tuple[str, Condition]


def _log_odds(key: _Key) -> str:
    return f"{'/'.join(key)}/log_odds"


def _candidates(key: _Key) -> str:
    return f"{'/'.join(key)}/candidates"


def _keys(split: JudgedSplit, conditions: Sequence[Condition]) -> list[_Key]:
    """Each reference under the first condition, and one with a scan under that which it feels."""
    scanned = LASER_SCAN in {column.name for column in split.dataset.index.columns}
    keys: list[_Key] = [(name, conditions[0]) for name in REFERENCES if scanned or name != SCAN]
    return keys + [(SCAN, c) for c in conditions[1:] if scanned and _scan_fails(c)]


def _scan_fails(condition: Condition) -> bool:
    """Whether it changes what a reference reads."""
    return FAILING_SENSOR.get(condition) == "lidar"


def _made(
    split: JudgedSplit, teach: Path, keys: Sequence[_Key], seed: int, progress: Progress
) -> Arrays:
    taught, chosen = rows_to_teach(teach), rows_to_choose(teach)
    examined = read_blind_rows(split.dataset.path, split.name, split.rows)
    found: Arrays = {}
    names = list(dict.fromkeys(name for name, _ in keys))
    progress.start("blind references", len(names))
    for name in names:
        trees = _Trees.taught(name, taught, chosen)
        for key in (key for key in keys if key[0] == name):
            found |= trees.said(key, _failed(examined, split, key[1], seed))
        progress.advance(TITLES[name])
    return found


@dataclass(frozen=True)
class _Trees:
    """Of one reference: for the driven trajectory, and where rows have candidates, for those."""

    driven: TaughtReference
    other: TaughtReference | None

    @classmethod
    def taught(cls, name: str, taught: BlindRows, chosen: BlindRows | None) -> Self:
        rows = (taught, chosen) if chosen is not None else (taught,)
        driven = teach_reference(*(each.driven(name) for each in rows))
        if taught.candidates is None:
            return cls(driven, None)
        return cls(driven, teach_reference(*(each.other(name) for each in rows)))

    def said(self, key: _Key, rows: BlindRows) -> Arrays:
        number, steps = rows.mask.shape
        found = {_log_odds(key): self.driven.log_odds(rows.driven(key[0]).features, steps)}
        if self.other is not None and rows.candidates is not None:
            odds = self.other.log_odds(rows.other(key[0]).features, 1)
            found[_candidates(key)] = odds.reshape(number, -1)
        return found


def _failed(rows: BlindRows, split: JudgedSplit, condition: Condition, seed: int) -> BlindRows:
    """The rows under a condition; of what references read it reaches the scan alone."""
    if not _scan_fails(condition) or LASER_SCAN not in rows.columns:
        return rows
    declared = {column.name for column in split.dataset.index.columns}
    names = tuple(name for name in ("stamp_ns",) if name in declared)
    stamps = Dataset(split.dataset.path, split.name, names, check="sha256").batch(split.rows)
    batch = {name: torch.from_numpy(stamps[name]) for name in names}
    batch[LASER_SCAN] = torch.from_numpy(rows.columns[LASER_SCAN].copy())
    failed = apply_condition(batch, condition, seed, settings_of_dataset(split.dataset.index))
    return replace(rows, columns=rows.columns | {LASER_SCAN: failed[LASER_SCAN].numpy()})
