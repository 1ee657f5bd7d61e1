"""AU-ROC within a scene: does the score tell which trajectory of the same row gets through?

AU-ROC over rows can be high for a model that only tells hard scenes from easy ones.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from graspe_data.arrays import Floats, Indices, Mask
from graspe_data.shards import Dataset
from graspe_data.shards.dataset_index import DatasetIndex
from model_zoo.contract import CANDIDATE_IMAGE, CANDIDATE_MASK, CANDIDATE_SUCCESS
from model_zoo.labels import check_binary

CANDIDATE_VELOCITY = "candidate_velocity"


@dataclass(frozen=True)
class Candidates:
    """The other trajectories of rows, whose outcome a simulated world knows.

    Attributes:
        velocity: float64 (N, K, 2), m/s and rad/s, held.
        through: bool (N, K), whether it succeeds to its end.
        mask: bool (N, K), whether the world was asked about it.
    """

    velocity: Floats
    through: Mask
    mask: Mask


def read_candidates(
    index: DatasetIndex, folder: Path, split: str, rows: Indices
) -> Candidates | None:
    """The candidates of rows; None where the dataset has none.

    Raises:
        ShardError: A column is damaged.
        ZooError: A label is neither 0 nor 1.
    """
    columns = (CANDIDATE_VELOCITY, CANDIDATE_SUCCESS, CANDIDATE_MASK)
    if not {column.name for column in index.columns} >= {CANDIDATE_IMAGE, *columns}:
        return None
    batch = Dataset(folder, split, columns, check="sha256").batch(rows)
    mask = batch[CANDIDATE_MASK].astype(bool)
    success = batch[CANDIDATE_SUCCESS]
    check_binary(success, mask[..., None], f"{folder}: split {split!r}: {CANDIDATE_SUCCESS}")
    through = np.asarray(success.astype(bool).all(axis=2))
    return Candidates(batch[CANDIDATE_VELOCITY].astype(np.float64), through, mask)


def scene_areas(log_odds: Floats, through: Mask, judged: Mask) -> Floats:
    """The AU-ROC among the candidates of each row, (N,); NaN where all end alike.

    Args:
        log_odds: (N, K), of getting through; whatever ranks as they do.
        through: bool (N, K), whether the candidate gets through.
        judged: bool (N, K), whether that is known.
    """
    areas = np.full(len(log_odds), np.nan)
    for row, (z, y, mask) in enumerate(zip(log_odds, through, judged, strict=True)):
        good, bad = z[mask & y], z[mask & ~y]
        if good.size and bad.size:
            above = good[:, None] > bad[None]
            areas[row] = np.mean(above + 0.5 * (good[:, None] == bad[None]))
    return areas


def resampled_mean(areas: Floats, recording: Indices, weights: Floats) -> Floats:
    """The mean over scenes in every resample of recordings, (S,); NaN for none.

    Args:
        areas: (N,), NaN where there is none.
        recording: (N,), each in 0 .. R - 1.
        weights: (S, R).
    """
    known = np.isfinite(areas)
    count = weights.shape[1]
    total = weights @ np.bincount(recording[known], areas[known], count)
    scenes = weights @ np.bincount(recording[known], minlength=count)
    with np.errstate(invalid="ignore", divide="ignore"):
        found: Floats = total / scenes
    return found
