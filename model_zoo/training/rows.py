"""Which rows an epoch reads, some of them mirrored, and how much each of them counts."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from torch import Tensor

from model_zoo.batches import RowSource
from model_zoo.labels import Labels
from model_zoo.resampling import TrainingRows, rows_for_training
from model_zoo.training.recipe import Balance

MIRRORED = "mirrored"


@dataclass(frozen=True)
class ChosenRows:
    """Some rows of a dataset, perhaps repeatedly, as if they were all.

    Attributes:
        dataset: Where the rows come from.
        rows: Which, in this order; where any is to be mirrored, batches have a column ``mirrored``
            (rows,) that says which.
        marks: Columns that the dataset does not hold, by name: bool, for each of its rows.
    """

    dataset: RowSource
    rows: TrainingRows
    marks: Mapping[str, NDArray[np.bool_]] = field(default_factory=dict)

    @property
    def digest(self) -> str:
        """The dataset's."""
        return self.dataset.digest

    def __len__(self) -> int:
        """Rows of an epoch."""
        return len(self.rows)

    def batch(self, indices: NDArray[np.int64]) -> dict[str, NDArray[np.generic]]:
        """The chosen rows at these places."""
        rows = self.rows.indices[indices]
        batch = self.dataset.batch(rows)
        batch |= {name: mark[rows] for name, mark in self.marks.items()}
        if self.rows.mirrored.any():
            batch[MIRRORED] = self.rows.mirrored[indices]
        return batch


def choose_rows(labels: Labels, balance: Balance) -> TrainingRows:
    """The rows with a judged step; under ``resample``, PAAD's choice among them.

    Raises:
        ZooError: Nothing to resample by: no row fails.
    """
    judged = labels.judged_rows
    if balance != "resample":
        return TrainingRows(judged, np.zeros(judged.size, np.bool_))
    chosen = rows_for_training(labels.failing[judged])
    return TrainingRows(judged[chosen.indices], chosen.mirrored)


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
    # A share s fails: weights 0.5 / s and 0.5 / (1 - s) give both kinds a half, and the mean 1.
    failing = labels.failing[labels.judged_rows]
    share = failing.mean()
    if balance != "rows" or failing.all() or not failing.any():
        return RowWeights()
    return RowWeights(float(0.5 / (1 - share)), float(0.5 / share))
