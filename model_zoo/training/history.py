"""What each epoch gave, which of them is the best, and whether to go on."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from graspe_data.manifest import Settings


class EpochRecord(Settings):
    """One epoch of a training.

    Attributes:
        epoch: Counted from 0.
        step: Steps done at its end.
        means: Mean over its steps of the loss (``loss``), of its parts and of the gradient's
            length.
        au_roc: On the validation rows, all judged steps pooled.
        validation_loss: Mean cross-entropy of the judged validation steps, nats.
        seconds: Its training and validation took, in the process that finished it.
        samples_per_s: Training rows a second, of all ranks.
        data_wait_share: Share of the training time spent waiting for a batch.
    """

    epoch: int
    step: int
    means: Mapping[str, float]
    au_roc: float
    validation_loss: float
    seconds: float = 0.0
    samples_per_s: float = 0.0
    data_wait_share: float = 0.0


def best_epoch(history: Sequence[EpochRecord]) -> int:
    """The place of the highest validation AU-ROC, the first where some are equal."""
    return max(range(len(history)), key=lambda place: (history[place].au_roc, -place))


def is_exhausted(history: Sequence[EpochRecord], patience: int | None) -> bool:
    """Whether the last ``patience`` epochs were no better than the best before them."""
    if patience is None or not history:
        return False
    return len(history) - 1 - best_epoch(history) >= patience
