"""Candidates beside the driven trajectory, where a simulated dataset knows how they end."""

from __future__ import annotations

from collections.abc import Collection
from pathlib import Path

import numpy as np
import torch
from torch import Tensor
from torch.nn.functional import softplus

from graspe_data.errors import ZooError
from graspe_data.shards import Dataset
from model_zoo.batches import Batch
from model_zoo.contract import (
    CANDIDATE_COLUMNS,
    CANDIDATE_IMAGE,
    CANDIDATE_MASK,
    CANDIDATE_SUCCESS,
    DRIVEN,
    SuccessModel,
)
from model_zoo.labels import MASK, SUCCESS, check_binary


def candidate_columns(
    model: SuccessModel, number: int, offered: Collection[str], where: str
) -> tuple[str, ...]:
    """The columns to read so that each row has ``number`` candidates; none for a model without.

    Raises:
        ZooError: The dataset does not have them.
    """
    if not number or DRIVEN not in model.candidate_columns:
        return ()
    if missing := [name for name in CANDIDATE_COLUMNS if name not in offered]:
        raise ZooError(
            f"{where}: the recipe asks for {number} candidates a row, and the dataset has no "
            f"column {', '.join(missing)}. Set the recipe's `candidates: 0`, or build it from "
            f"recordings of `graspe simulate` with `candidates:` in the dataset's manifest."
        )
    return CANDIDATE_COLUMNS


def check_candidates(folder: Path, split: str, number: int, horizon: int) -> None:
    """Hold what a dataset knows of candidates against what a recipe and a model ask for.

    Raises:
        ZooError: The rows have fewer, of another horizon or size of picture, or labels that are
            neither 0 nor 1.
        ShardError: The columns are damaged.
    """
    rows = Dataset(folder, split, (CANDIDATE_SUCCESS, CANDIDATE_MASK), check="sha256")
    declared = {column.name: column for column in rows.index.columns}
    known = declared[CANDIDATE_MASK].shape[0]
    _check_number(known, number)
    expected = {
        CANDIDATE_SUCCESS: (known, horizon),
        CANDIDATE_IMAGE: (known, *declared[DRIVEN].shape),
    }
    for name, shape in expected.items():
        if declared[name].shape != shape:
            raise ZooError(
                f"{folder}: column {name} has rows of {declared[name].shape}, expected {shape}: "
                "one for each candidate, as those of the driven trajectory. Build it again."
            )
    arrays = rows.batch(np.arange(len(rows)))
    judged = arrays[CANDIDATE_MASK].astype(bool)[:, :, None]
    check_binary(
        arrays[CANDIDATE_SUCCESS], judged, f"{folder}: split {split!r}: {CANDIDATE_SUCCESS}"
    )


def draw_candidates(batch: Batch, number: int, seed: int, step: int) -> Batch:
    """Keep ``number`` candidates of each row, drawn anew for every step.

    Raises:
        ZooError: The rows have fewer.
    """
    rows, known = batch[CANDIDATE_MASK].shape
    _check_number(known, number)
    # The first K of a random order of each row: K different ones, all alike likely.
    drawn = np.random.default_rng([seed, step, 0, 3]).random((rows, known)).argsort(axis=1)
    kept, row = torch.from_numpy(drawn[:, :number].copy()), torch.arange(rows)[:, None]
    return batch | {name: batch[name][row, kept] for name in CANDIDATE_COLUMNS}


def join_candidates(batch: Batch) -> tuple[Tensor, Tensor, Tensor, Tensor]:
    """The driven trajectory of each row, then its candidates, scene by scene.

    Returns:
        Trajectory images (B (1 + K), H, W), success float32 and mask bool (B (1 + K), T), and the
        share of each in its row's weight: a half for the driven one, a half for all others, times
        1 + K, so that their mean is 1.
    """
    images = torch.cat([batch[DRIVEN][:, None], batch[CANDIDATE_IMAGE]], dim=1)
    success = torch.cat([batch[SUCCESS][:, None], batch[CANDIDATE_SUCCESS]], dim=1).float()
    judged = batch[CANDIDATE_MASK].bool()[:, :, None].expand(-1, -1, success.shape[2])
    mask = torch.cat([batch[MASK].bool()[:, None], judged], dim=1)
    rows, number = images.shape[:2]
    # A half of the weight for the driven trajectory, a half for all candidates; mean 1 over 1 + K.
    share = success.new_full((rows, number), number / (2 * (number - 1)))
    share[:, 0] = number / 2
    return images.flatten(0, 1), success.flatten(0, 1), mask.flatten(0, 1), share.flatten()


def _check_number(known: int, number: int) -> None:
    if known < number:
        raise ZooError(
            f"recipe: candidates is {number}, the dataset's rows have {known}. Set it lower."
        )


def ranking_loss(logits: Tensor, success: Tensor, mask: Tensor, scenes: int) -> Tensor:
    """The mean of log(1 + exp(fails - succeeds)) over pairs of which one fails, a scalar.

    A pair is two trajectories in the same scene at the same step, both judged, of which one
    succeeds: the loss is the cross-entropy of telling which (Burges et al., RankNet, ICML 2005).
    The cross-entropy of each alone is mostly about how hard the scene is; here that cancels.

    Args:
        logits: (B n, T), log-odds of success, scene by scene.
        success: float32 (B n, T), 1 = success.
        mask: bool (B n, T), whether the step is judged.
        scenes: B.

    Returns:
        0 where there is no pair.
    """
    # Trajectories by scene: (B, n, T).
    number, steps = len(logits) // scenes, logits.shape[1]
    by_scene = (scenes, number, steps)
    odds, judged = logits.float().view(by_scene), mask.view(by_scene)
    succeeds = judged & (success.view(by_scene) > 0)
    fails = judged & (success.view(by_scene) == 0)
    # Of every pair (i, j) in a scene, at every step: whether i succeeds where j fails, and the
    # cross-entropy of telling so by their log-odds; (B, n, n, T).
    pairs = succeeds[:, :, None] & fails[:, None, :]
    apart = softplus(odds[:, None, :] - odds[:, :, None])
    return (apart * pairs).sum() / pairs.sum().clamp_min(1)
