"""Batches of a dataset as torch tensors, in an order that can be resumed and shared by ranks."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Protocol

import numpy as np
import torch
from numpy.typing import NDArray
from torch.utils.data import DataLoader, Sampler
from torch.utils.data import Dataset as TorchDataset

from graspe_data.errors import ShardError
from graspe_data.shards import EpochOrder
from graspe_data.shards.epoch_order import Step, Tail

Batch = dict[str, torch.Tensor]
Transform = Callable[[Batch, int], Batch]
"""Changes a batch; the number differs for every batch of every rank and is the same in any run."""


class RowSource(Protocol):
    """Rows by index, such as a :class:`graspe_data.shards.Dataset`."""

    @property
    def digest(self) -> str:
        """Names the rows and their order."""

    def __len__(self) -> int:
        """How many there are."""

    def batch(self, indices: NDArray[np.int64]) -> dict[str, NDArray[np.generic]]:
        """Rows by index, each column as one array (rows, *shape)."""


class BatchLoader:
    """Iterate over one epoch of batches; the next iteration is the next epoch.

    Each batch maps column names to tensors (batch_size, *shape) of the column's own dtype: pictures
    stay uint8. The order is that of :class:`EpochOrder`, whatever the number of workers. Leaving
    an epoch in the middle and iterating again goes on where it was left.

    Attributes:
        order: Who reads which rows when.
        dataset: Where they come from.
    """

    def __init__(
        self,
        dataset: RowSource,
        batch_size: int,
        *,
        seed: int = 0,
        rank: int = 0,
        world_size: int = 1,
        tail: Tail = "keep",
        workers: int = 0,
        pin_memory: bool | None = None,
        transform: Transform | None = None,
    ) -> None:
        """Prepare to load, from the beginning of epoch 0.

        Args:
            dataset: A split, with the columns wanted, decoded.
            batch_size: Rows a batch and a rank.
            seed: Seed of the order.
            rank: This process among those that share an epoch.
            world_size: How many they are.
            tail: What becomes of the last rows of an epoch: see :class:`EpochOrder`. Under
                DistributedDataParallel take ``drop`` or ``pad``.
            workers: Processes that read ahead; 0 reads in this one, at memory speed.
            pin_memory: Page-locked batches; None takes them where there is a CUDA device.
            transform: Done to each batch, where it is read: in the workers if there are some.

        Raises:
            ShardError: A rank, batch size or empty split that makes no sense.
        """
        self.dataset = dataset
        self.order = EpochOrder(
            len(dataset), dataset.digest, seed, batch_size, rank, world_size, tail
        )
        self._steps = _Steps(self.order)
        self._loader = DataLoader(
            _Gather(dataset, transform, rank),
            batch_size=None,
            sampler=self._steps,
            num_workers=workers,
            persistent_workers=workers > 0,
            pin_memory=torch.cuda.is_available() if pin_memory is None else pin_memory,
        )

    @property
    def epoch(self) -> int:
        """The epoch of the next batch, from 0."""
        return self.order.epoch_of(self._steps.position)

    def __len__(self) -> int:
        """Batches of a whole epoch."""
        full, rest = divmod(self.order.rows, self.order.step_size)
        return full + (rest > 0 and self.order.tail != "drop")

    def __iter__(self) -> Iterator[Batch]:
        """The batches from here to the end of the epoch."""
        for step, batch in zip(self.steps(), self._loader, strict=True):
            self._steps.position = step.next_position
            yield batch

    def steps(self) -> Iterator[Step]:
        """The steps from here to the end of the epoch, without reading a row."""
        return self._steps.remaining()

    def state(self) -> int:
        """Samples consumed by all ranks: all there is to save, with ``dataset.digest``."""
        return self._steps.position

    def resume(self, state: int, digest: str) -> None:
        """Go on after ``state``, saved by a run with any number of ranks or workers.

        Args:
            state: What :meth:`state` returned.
            digest: ``dataset.digest`` of then; where the dataset lies does not matter.

        Raises:
            ShardError: The dataset is another one, or the state is negative.
        """
        self.order.check_digest(digest)
        if state < 0:
            raise ShardError(f"state {state}: expected the samples consumed, 0 or more.")
        self._steps.position = state


class _Gather(TorchDataset[Batch]):
    """A dataset whose items are the batches of steps."""

    def __init__(self, dataset: RowSource, transform: Transform | None, rank: int) -> None:
        self._dataset = dataset
        self._transform = transform
        self._rank = rank

    def __getitem__(self, step: Step) -> Batch:
        arrays = self._dataset.batch(step.indices)
        batch = {name: torch.from_numpy(array) for name, array in arrays.items()}
        if self._transform is None:
            return batch
        return self._transform(batch, step.next_position - self._rank)


class _Steps(Sampler[Step]):
    """The position in an order, and the steps from there on.

    It knows nothing of the loader: in a reference cycle, a loader that is dropped would keep its
    workers until the garbage collector comes, and then wait for them.
    """

    def __init__(self, order: EpochOrder) -> None:
        self._order = order
        self.position = 0

    def remaining(self) -> Iterator[Step]:
        return self._order.epoch_steps(self.position)

    def __iter__(self) -> Iterator[Step]:
        return self.remaining()
