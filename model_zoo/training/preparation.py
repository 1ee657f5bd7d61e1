"""What is done to training batches after they are read: rows are mirrored, sensors fail."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

from model_zoo.augmentation.augment import augment, check_lidar_may_fail, columns_needed
from model_zoo.augmentation.failing_rows import RowFailure
from model_zoo.augmentation.mirror import mirror
from model_zoo.augmentation.reliability import give_reliabilities
from model_zoo.augmentation.settings import AugmentationSettings, ReliabilitySource
from model_zoo.batches import Batch
from model_zoo.contract import CANDIDATE_MASK
from model_zoo.training.candidates import draw_candidates
from model_zoo.training.rows import MIRRORED

_WHOLE_LIDAR = (
    "set the probability of sector_loss, thinning and scatter to 0 in the recipe's augmentation"
)


@dataclass(frozen=True)
class Preparation:
    """Prepares batches, where they are read; its randomness follows from seed and number alone.

    Attributes:
        augmentation: None leaves rows as they are, but for those marked ``mirrored``.
        seed: The recipe's.
        candidates: How many each row keeps, where it has some.
    """

    augmentation: AugmentationSettings | None
    seed: int
    candidates: int = 0

    def __call__(self, batch: Batch, number: int) -> Batch:
        """Draw candidates, mirror the marked rows and drop the mark, then augment.

        Args:
            batch: Columns of the same rows.
            number: Of the batch, its own among those of all ranks.
        """
        if CANDIDATE_MASK in batch:
            batch = draw_candidates(batch, self.candidates, self.seed, number)
        if MIRRORED in batch:
            marked = batch[MIRRORED]
            batch = mirror({key: batch[key] for key in batch if key != MIRRORED}, marked)
        if self.augmentation is None:
            return batch
        return augment(batch, self.augmentation, self.seed, number)

    def columns(
        self, wanted: Collection[str], offered: Collection[str], where: str
    ) -> tuple[str, ...]:
        """The columns to read so that these can be prepared.

        Raises:
            ZooError: Augmentation does not know one of them, or the dataset, named by ``where``,
                lacks what r_point of a failing lidar is computed from.
        """
        if self.augmentation is None:
            return tuple(wanted)
        if self.augmentation.lidar_may_fail:
            check_lidar_may_fail(wanted, offered, where, _WHOLE_LIDAR)
        return columns_needed(wanted, offered)


@dataclass(frozen=True)
class SoundRows:
    """Prepares validation batches: nothing fails, and reliabilities come from their source."""

    reliability: ReliabilitySource
    seed: int

    def __call__(self, batch: Batch, number: int) -> Batch:
        """Give each row the reliabilities that its model is taught with."""
        rows = len(next(iter(batch.values()), ()))
        failures = [RowFailure((0, 0, 0))] * rows
        return give_reliabilities(batch, self.reliability, failures, [self.seed, number, 1])
