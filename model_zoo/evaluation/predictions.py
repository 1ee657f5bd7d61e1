"""What a model predicts for the rows of a split, under each condition of the sensors."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
import torch

from graspe_data.arrays import Floats
from graspe_data.errors import ZooError
from graspe_data.progress import Progress
from model_zoo.augmentation import Condition, apply_condition
from model_zoo.augmentation.reliability import taught_with
from model_zoo.augmentation.settings import AugmentationSettings, settings_of_dataset
from model_zoo.batches import Batch
from model_zoo.checkpoints import Checkpoint
from model_zoo.contract import CANDIDATE_IMAGE, DRIVEN
from model_zoo.evaluation.judged_split import JudgedSplit
from model_zoo.evaluation.score_cells import Said


def predict_split(
    checkpoint: Checkpoint,
    split: JudgedSplit,
    conditions: Sequence[Condition],
    batch_size: int,
    seed: int,
    progress: Progress,
) -> dict[str, Said]:
    """Predict every row under every condition; each row is read once.

    Returns:
        For each condition the calibrated log-odds of success; for the first one, where rows have
        candidates and the model reads their pictures, the least over the steps of each candidate
        too. They take as long as all else together.

    Raises:
        ZooError: The model predicts numbers that are not finite.
        ShardError: A shard is missing or damaged.
    """
    given = AugmentationSettings(reliability=taught_with(checkpoint.recipe))
    settings = settings_of_dataset(split.dataset.index, given)
    found: dict[str, list[Said]] = {condition: [] for condition in conditions}
    progress.start("batches", -(-split.rows.size // batch_size))
    for done, batch in _batches(split, batch_size):
        for condition in conditions:
            degraded = apply_condition(batch, condition, seed, settings)
            batch.pop(CANDIDATE_IMAGE, None)
            found[condition].append(_predict(checkpoint, degraded, condition))
        progress.advance(f"{checkpoint.config.model}: {done} of {split.rows.size} rows")
    return {condition: _joined(parts) for condition, parts in found.items()}


def _joined(parts: Sequence[Said]) -> Said:
    others = [part.candidates for part in parts if part.candidates is not None]
    log_odds = np.concatenate([part.log_odds for part in parts])
    return Said(log_odds, np.concatenate(others) if others else None)


def _batches(split: JudgedSplit, batch_size: int) -> Iterator[tuple[int, Batch]]:
    for begin in range(0, split.rows.size, batch_size):
        rows = split.rows[begin : begin + batch_size]
        columns = split.dataset.batch(rows)
        yield begin + rows.size, {name: torch.from_numpy(a) for name, a in columns.items()}


def _predict(checkpoint: Checkpoint, batch: Batch, condition: str) -> Said:
    images = batch.get(CANDIDATE_IMAGE)
    if images is None or DRIVEN not in checkpoint.model.candidate_columns:
        return Said(_log_odds(checkpoint, batch, condition))
    # The driven trajectory of each row, then its candidates: (B, 1 + K, H, W).
    drawn = torch.cat([batch[DRIVEN][:, None], images], dim=1)
    joined = dict(batch) | {DRIVEN: drawn.flatten(0, 1)}
    found = _log_odds(checkpoint, joined, condition).reshape(*drawn.shape[:2], -1)
    return Said(found[:, 0], found[:, 1:].min(axis=2))


def _log_odds(checkpoint: Checkpoint, batch: Batch, condition: str) -> Floats:
    log_odds: Floats = checkpoint.log_odds(batch).cpu().numpy()
    if not np.isfinite(log_odds).all():
        raise ZooError(
            f"{checkpoint.folder}: {checkpoint.config.model} predicts numbers that are not finite "
            f"under {condition!r}. Look for NaN in the columns that it reads, or train it again."
        )
    return log_odds
