"""Whether a dataset holds what its digest names: what is trained on is what the checkpoint says."""

from __future__ import annotations

from collections.abc import Collection
from pathlib import Path

from graspe_data.shards import Dataset
from model_zoo.training.progress import SilentProgress, TrainingProgress


def check_contents(
    folder: Path, split: str, columns: Collection[str], progress: TrainingProgress | None = None
) -> None:
    """Read every byte of some columns once and compare their SHA-256 with ``dataset.json``.

    SHA-256 and not the CRC-32 that lies in the shard: a shard in another's place fits its own CRC.
    And each time, without a note beside the dataset that it was sound: pictures then lie in the
    page cache, where the first epoch finds them. ``benchmarks/results/check_contents.md``
    has the cost.

    Args:
        folder: The dataset.
        split: Whose shards.
        columns: Those that will be read.
        progress: Is told of the rows whose shards were checked.

    Raises:
        ShardError: Names the shard and the column that is damaged, or in another's place.
    """
    rows = Dataset(folder, split, columns, check="sha256")
    progress = progress or SilentProgress()
    for passed in rows.check_shards():
        progress.aside(f"checking {split} shards", passed, len(rows))
