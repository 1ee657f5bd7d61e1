"""Shard: the rows of all episodes, by split, shuffled, in shards."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from graspe_data.columns import Column
from graspe_data.shards.dataset_index import ShardFile
from graspe_data.shards.shard_writer import write_shard
from graspe_data.shards.stored_columns import stored_dtype
from pipelines.dataset_settings import Split
from pipelines.episode import StoredColumn

SMALL_ROW = 256


@dataclass(frozen=True)
class EpisodeSource:
    """Rows of the episode of one recording, and which folder holds which column.

    ``recording``: its place in the index. ``rows``: int64 (R,), those of the episode that count.
    """

    recording: int
    rows: NDArray[np.int64]
    folders: Mapping[str, Path]


@dataclass(frozen=True)
class ShardTask:
    """One shard: its rows as (episode, row) pairs, int64 (R, 2), in order."""

    dataset: Path
    path: str
    columns: tuple[Column, ...]
    episodes: tuple[EpisodeSource, ...]
    rows: NDArray[np.int64]


def plan_shards(
    dataset: Path,
    split: Split,
    columns: Sequence[Column],
    episodes: Sequence[EpisodeSource],
    rows_per_shard: int,
    seed: int,
) -> Iterator[ShardTask]:
    """Shuffle the rows of a split and cut them into shards.

    The order is a pure function of the seed, the split and the rows, whatever the shards' size;
    shards are named by the rows and columns they hold, so old and new never share a name.
    """
    pairs = [
        np.stack([np.full(source.rows.size, index), source.rows], axis=1)
        for index, source in enumerate(episodes)
    ]
    rows = np.concatenate([np.empty((0, 2), np.int64), *pairs])
    word = int.from_bytes(hashlib.sha256(f"{seed}/{split}".encode()).digest()[:16], "big")
    rows = rows[np.random.Generator(np.random.Philox(key=word)).permutation(len(rows))]
    for number, start in enumerate(range(0, len(rows), rows_per_shard)):
        part = rows[start : start + rows_per_shard]
        name = _content_name(columns, episodes, part)
        path = f"shards/{split}-{number:05d}-{name}.npz"
        yield ShardTask(dataset, path, tuple(columns), tuple(episodes), part)


def make_shard(task: ShardTask) -> ShardFile:
    """Gather the rows of a shard from the episodes and write it."""
    arrays: dict[str, NDArray[np.generic]] = {}
    for column in task.columns:
        gathered = _gather(task, column)
        if column.codec == "png":
            arrays |= _encoded(column.name, gathered)
        else:
            arrays[column.name] = gathered
    return write_shard(task.dataset, task.path, task.columns, arrays)


def _content_name(
    columns: Sequence[Column], episodes: Sequence[EpisodeSource], rows: NDArray[np.int64]
) -> str:
    digest = hashlib.sha256(rows.tobytes())
    for column in columns:
        digest.update(column.model_dump_json().encode())
    for index in np.unique(rows[:, 0]).tolist():
        source = episodes[index]
        folders = sorted({folder.name for folder in source.folders.values()})
        digest.update(f"{index} {source.recording} {folders}".encode())
    return digest.hexdigest()[:12]


def _gather(task: ShardTask, column: Column) -> NDArray[np.generic]:
    raw = column.codec == "png"
    shape = column.shape if raw else column.stored_shape
    dtype = np.dtype(column.dtype) if raw else stored_dtype(column)
    gathered = np.empty((len(task.rows), *shape), dtype)
    for index in np.unique(task.rows[:, 0]).tolist():
        source, here = task.episodes[index], np.flatnonzero(task.rows[:, 0] == index)
        if column.stage == "shard":
            gathered[here] = source.recording
            continue
        with StoredColumn(source.folders[column.stage], column.name) as values:
            if column.row_bytes <= SMALL_ROW:
                gathered[here] = values.all()[task.rows[here, 1]]
                continue
            for target, row in zip(here.tolist(), task.rows[here, 1].tolist(), strict=True):
                values.read_into(gathered[target], row)
    return gathered


def _encoded(name: str, pictures: NDArray[np.generic]) -> dict[str, NDArray[np.generic]]:
    encoded = [
        cv2.imencode(".png", cv2.cvtColor(picture, cv2.COLOR_RGB2BGR))[1].ravel()
        for picture in pictures.astype(np.uint8, copy=False)
    ]
    offsets = np.cumsum([0, *(part.size for part in encoded)], dtype=np.int64)
    return {f"{name}.bytes": np.concatenate(encoded), f"{name}.offsets": offsets}
