"""The small columns of a split, read a block of rows at a time."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from graspe_data.shards.dataset import Dataset

ROWS_A_BLOCK = 65_536


@dataclass(frozen=True)
class Block:
    """Consecutive rows of a split, from ``start`` on: each column (rows, *shape)."""

    start: int
    columns: dict[str, NDArray[Any]]


def row_blocks(
    folder: Path,
    split: str,
    columns: Collection[str],
    rows: int = ROWS_A_BLOCK,
    *,
    decode: bool = True,
) -> Iterator[Block]:
    """Go over a split in blocks, so that memory does not grow with it.

    Without ``decode`` columns come as stored: bits stay packed.

    Raises:
        ShardError: No valid dataset there, or it has no such split or column.
    """
    dataset = Dataset(folder, split, columns, decode=decode)
    for start in range(0, len(dataset), rows):
        yield Block(start, dataset.batch(np.arange(start, min(start + rows, len(dataset)))))
