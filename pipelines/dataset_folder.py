"""The folder of a dataset: held by one build, what an earlier one left in it, and what may go."""

from __future__ import annotations

import shutil
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path

from graspe_data.atomic_file import PARTIAL_SUFFIX
from graspe_data.errors import ShardError, StageError
from graspe_data.folder_lock import hold_folder
from graspe_data.shards.dataset_index import (
    INDEX_FILE,
    DatasetIndex,
    ShardFile,
    read_index,
)
from graspe_data.shards.verify import verify_shard
from graspe_data.whole_folder import sweep

EPISODES = "episodes"


@contextmanager
def only_builder(folder: Path) -> Iterator[None]:
    """Hold a folder for one build, made if it is not there, and rid it of half-made files.

    Raises:
        StageError: It cannot be made, other files lie in it, or another build is at work there.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise StageError(
            f"{folder}: cannot be the dataset's folder: {error.strerror}. Give another --out."
        ) from error
    _check_ours(folder)
    with hold_folder(folder, "building", StageError):
        sweep(folder)
        yield


def _check_ours(folder: Path) -> None:
    names = sorted(path.name for path in folder.iterdir())
    if {EPISODES, INDEX_FILE} & set(names):
        return
    if others := [name for name in names if not name.endswith(PARTIAL_SUFFIX)]:
        raise StageError(
            f"{folder}: holds other files ({', '.join(others[:3])}), so it is no place for a "
            f"dataset. Give a new folder to --out."
        )


def earlier_shards(folder: Path) -> dict[str, ShardFile]:
    """The shards that an earlier build committed and that are still whole, by path."""
    if not (folder / INDEX_FILE).is_file():
        return {}
    try:
        index = read_index(folder)
    except ShardError:
        return {}
    return {
        shard.path: shard
        for split, shards in index.splits.items()
        for shard in shards
        if not verify_shard(folder, index, split, shard)
    }


def prune(folder: Path, index: DatasetIndex, stages: Iterable[Iterable[Path]]) -> None:
    """Remove shards that the dataset does not refer to, and superseded stages of its episodes.

    Args:
        folder: Of the dataset.
        index: As it was committed.
        stages: Of each episode the folders of its stages that count.
    """
    kept = {folder / shard.path for split in index.splits.values() for shard in split}
    for path in (folder / "shards").glob("*.npz"):
        if path not in kept:
            path.unlink()
    for episode in stages:
        current = set(episode)
        for former in next(iter(current)).parent.iterdir():
            if former not in current:
                shutil.rmtree(former)
