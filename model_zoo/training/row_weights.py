"""Weights under which rows that fail and rows that do not count alike."""

from __future__ import annotations

from dataclasses import dataclass

from torch import Tensor

from model_zoo.labels import Labels
from model_zoo.training.recipe import Balance


@dataclass(frozen=True)
class RowWeights:
    """The weight of a row by whether it fails; their mean over the training rows is 1.

    Attributes:
        succeeding: Of rows without a judged step that fails.
        failing: Of the others.
    """

    succeeding: float = 1.0
    failing: float = 1.0

    def of(self, success: Tensor, mask: Tensor) -> Tensor:
        """The weights of a batch.

        Args:
            success: float32 (B, T), 1 = success.
            mask: bool (B, T), whether the step is judged.

        Returns:
            float32 (B,).
        """
        fails = ((success == 0) & mask).any(dim=1)
        return success.new_full(fails.shape, self.succeeding).where(~fails, self.failing)


def balance_rows(labels: Labels, balance: Balance) -> RowWeights:
    """The weights for a split: under ``rows`` both kinds weigh half, else each row is 1."""
    failing = labels.failing[labels.judged_rows]
    share = failing.mean()
    if balance != "rows" or failing.all() or not failing.any():
        return RowWeights()
    return RowWeights(float(0.5 / (1 - share)), float(0.5 / share))
