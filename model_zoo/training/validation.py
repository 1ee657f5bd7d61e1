"""What a model says of the validation rows, from all ranks."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from lightning_fabric import Fabric
from numpy.typing import NDArray
from torch import Tensor, nn

from graspe_data.arrays import Floats, Mask
from graspe_data.errors import ZooError
from model_zoo.batches import BatchLoader
from model_zoo.contract import SuccessModel
from model_zoo.labels import MASK, SUCCESS
from model_zoo.metrics import au_roc
from model_zoo.training.progress import TrainingProgress

SELECTING, CALIBRATING = "selecting", "calibrating"
"""Marks of the validation rows."""
_WITH_LOGITS = (SUCCESS, MASK, SELECTING, CALIBRATING)


@dataclass(frozen=True)
class Predictions:
    """Logits and labels of the same rows, in any order.

    Attributes:
        logits: float64 (N, T), log-odds of success.
        success: bool (N, T).
        mask: bool (N, T), whether the step is judged.
        selecting: bool (N,), the rows that select the epoch.
        calibrating: bool (N,), the rows that fit the temperature.
    """

    logits: NDArray[np.float64]
    success: NDArray[np.bool_]
    mask: NDArray[np.bool_]
    selecting: NDArray[np.bool_]
    calibrating: NDArray[np.bool_]

    def of(self, rows: NDArray[np.bool_]) -> tuple[Floats, Mask, Mask]:
        """Logits, labels and judged steps of some rows."""
        return self.logits[rows], self.success[rows], self.mask[rows]

    def au_roc(self) -> float:
        """Area under the ROC curve of the rows that select, their judged steps pooled.

        Raises:
            ZooError: A logit is not finite, or the labels are all of one class.
        """
        area = au_roc(*self.of(self.selecting))
        if area is None:
            raise ZooError("validation: the judged steps are all of one class.")
        return area

    def loss(self) -> float:
        """Mean cross-entropy of the judged steps of the rows that select, nats."""
        logits, success, mask = self.of(self.selecting)
        logits, success = logits[mask], success[mask]
        return float(np.mean(np.logaddexp(0, logits) - success * logits))


def predict(
    fabric: Fabric,
    model: SuccessModel,
    loader: BatchLoader,
    progress: TrainingProgress,
) -> Predictions:
    """Run the model over all rows, shared by the ranks; it is left in evaluation mode.

    All ranks look with the buffers of rank 0, so that what is predicted is one model's; and in
    float32, whatever the precision of the training, since so does whoever loads the checkpoint. The
    rows come in the same order each time, so that sums over them are the same to the bit.

    Args:
        fabric: The ranks.
        model: Not wrapped.
        loader: With tail ``pad``; it is wound back.
        progress: Is told of each batch, by rank 0.

    Returns:
        The predictions of all rows, on every rank.
    """
    model.eval()
    share_buffers(fabric, model)
    loader.resume(0, loader.order.digest)
    parts: list[tuple[Tensor, ...]] = []
    with torch.inference_mode():
        for loaded in loader:
            batch = fabric.to_device(loaded)
            logits = model.logits({name: batch[name] for name in model.columns})
            if fabric.is_global_zero:
                progress.aside("validation", len(parts) + 1, len(loader))
            parts.append((logits.double(), *(batch[name].bool() for name in _WITH_LOGITS)))
    gathered = [
        _gather(fabric, torch.cat(column), loader.order.rows) for column in zip(*parts, strict=True)
    ]
    return Predictions(*(column.cpu().numpy() for column in gathered))


def _gather(fabric: Fabric, mine: Tensor, rows: int) -> Tensor:
    """Of each step rank r took every world_size-th row: interleave, and cut the padding off."""
    if fabric.world_size == 1:
        return mine[:rows]
    everyone = fabric.all_gather(mine)
    if not isinstance(everyone, Tensor):
        raise TypeError(type(everyone))
    # (ranks, steps, ...) to (steps, ranks, ...), so that flattened the rows are in their order.
    return everyone.transpose(0, 1).flatten(0, 1)[:rows]


def share_buffers(fabric: Fabric, model: nn.Module) -> None:
    """Give every rank the buffers of rank 0, such as the running means of batch normalisation.

    Gradients are averaged, so weights are the same everywhere; buffers are not: each rank counts
    its own rows. Of rank 0, and no average, for two reasons. DistributedDataParallel hands out rank
    0's buffers before each step in training, so an average would be of its last step alone. And
    rank 0 saves the state, so that a training which goes on from it has what this one had.

    Args:
        fabric: The ranks.
        model: Not wrapped, on the rank's device.
    """
    if fabric.world_size == 1:
        return
    for buffer in model.buffers():
        torch.distributed.broadcast(buffer, src=0)
