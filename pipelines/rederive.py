"""Prove rows: derive some again from the recordings and compare the bytes."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from graspe_data.columns import Column
from graspe_data.errors import GraspeError, ShardError
from graspe_data.manifest import validate
from graspe_data.recordings import recording_digest
from graspe_data.shards.dataset import Dataset
from graspe_data.shards.dataset_index import DatasetIndex, RecordingEntry, read_index
from graspe_data.shards.stored_columns import decode_rows
from pipelines.dataset_settings import DatasetRecipe
from pipelines.episode import StoredColumn, whole_column
from pipelines.stage_record import StageRecord
from pipelines.stages.label import find_annotation
from pipelines.stages.sequence import STAGES
from pipelines.stages.stage import Work, after


@dataclass(frozen=True)
class Rederivation:
    """How many rows were derived again, and every difference that was found."""

    rows: int
    faults: tuple[str, ...]
    not_given: tuple[str, ...] = ()
    """Recordings of the dataset that were not given, so that none of their rows was derived."""


@dataclass(frozen=True)
class _Choice:
    split: str
    rows: NDArray[np.int64]
    stamps: NDArray[np.int64]


def rederive_rows(folder: Path, recordings: Sequence[Path], count: int, seed: int) -> Rederivation:
    """Derive random rows of a dataset again and compare every stored byte.

    Args:
        folder: The dataset.
        recordings: Where the recordings lie now; found by digest, whatever their names.
        count: Rows to derive, at most.
        seed: Of the choice.

    Raises:
        ShardError: The dataset cannot be read, or none of its recordings is given.
    """
    index = read_index(folder)
    recipe = _recipe(index)
    by_digest = {recording_digest(path): path for path in recordings}
    wanted = {number: entry for number, entry in enumerate(index.recordings) if entry.rows}
    paths = {n: by_digest[entry.digest] for n, entry in wanted.items() if entry.digest in by_digest}
    if not paths:
        raise ShardError(
            f"{folder}: none of the given recordings is one of this dataset's: "
            f"{', '.join(entry.name for entry in index.recordings if entry.rows)}."
        )
    chosen = _choose(folder, index, sorted(paths), count, seed)
    faults: list[str] = []
    for number, choices in chosen.items():
        entry = index.recordings[number]
        try:
            its_recipe = recipe.for_recording(entry.name)
            faults += _compare(folder, its_recipe, entry, paths[number], choices)
        except GraspeError as error:
            faults.append(f"{entry.name}: cannot be derived again: {error}")
    total = sum(choice.rows.size for choices in chosen.values() for choice in choices)
    not_given = list(dict.fromkeys(e.name for n, e in wanted.items() if n not in paths))
    return Rederivation(total, tuple(faults), tuple(not_given))


def _recipe(index: DatasetIndex) -> DatasetRecipe:
    dataset = index.configuration.get("dataset")
    content = {
        "dataset": {**(dataset if isinstance(dataset, dict) else {}), "storage": index.storage},
        "robot": index.configuration.get("robot"),
    }
    return validate(content, DatasetRecipe, f"{index.name}: configuration in dataset.json")


def _choose(
    folder: Path, index: DatasetIndex, numbers: Sequence[int], count: int, seed: int
) -> dict[int, list[_Choice]]:
    pool = []
    for split in index.splits:
        if index.rows(split):
            batch = _all_rows(folder, split)
            known = np.isin(batch["recording"], numbers)
            pool += [
                (int(batch["recording"][row]), split, row, int(batch["stamp_ns"][row]))
                for row in np.flatnonzero(known).tolist()
            ]
    picks = np.random.default_rng(seed).permutation(len(pool))[:count]
    chosen: dict[int, list[_Choice]] = {}
    grouped: dict[tuple[int, str], list[tuple[int, int]]] = {}
    for pick in np.sort(picks).tolist():
        number, split, row, stamp = pool[pick]
        grouped.setdefault((number, split), []).append((row, stamp))
    for (number, split), pairs in grouped.items():
        rows, stamps = np.array(pairs, np.int64).T
        chosen.setdefault(number, []).append(_Choice(split, rows, stamps))
    return chosen


def _all_rows(folder: Path, split: str) -> dict[str, NDArray[np.generic]]:
    dataset = Dataset(folder, split, columns=("recording", "stamp_ns"))
    return dataset.batch(np.arange(len(dataset)))


def _compare(
    folder: Path,
    recipe: DatasetRecipe,
    entry: RecordingEntry,
    path: Path,
    choices: Sequence[_Choice],
) -> Iterator[str]:
    stamps = np.concatenate([choice.stamps for choice in choices])
    with tempfile.TemporaryDirectory(prefix="graspe-") as scratch:
        folders: dict[str, Path] = {each.name: Path(scratch) / each.name for each in STAGES}
        for stage in folders.values():
            stage.mkdir()
        records = _derive(recipe, entry, path, folders, stamps)
        stale = records["label"].key != entry.stages.get("label")
        if stale:
            yield (
                f"{entry.name}: its labels file, or this program, changed since the build: run "
                f"`graspe dataset build` again."
            )
        made = whole_column(folders["extract"], "stamp_ns")
        for choice in choices:
            stored = Dataset(folder, choice.split)
            batch = stored.batch(choice.rows)
            for column in stored.columns:
                if column.stage == "shard" or (stale and column.stage == "label"):
                    continue
                with StoredColumn(folders[column.stage], column.name) as derived:
                    for position, stamp in enumerate(choice.stamps.tolist()):
                        again = _row(column, derived, np.flatnonzero(made == stamp))
                        if again is None or again != batch[column.name][position].tobytes():
                            yield (
                                f"{choice.split} row {choice.rows[position]} ({entry.name} at "
                                f"{stamp} ns): column {column.name} differs from the recording."
                            )


def _derive(
    recipe: DatasetRecipe,
    entry: RecordingEntry,
    path: Path,
    folders: dict[str, Path],
    stamps: NDArray[np.int64],
) -> dict[str, StageRecord]:
    work = Work(path, entry.digest, recipe, find_annotation(path, entry.digest), only=stamps)
    records: dict[str, StageRecord] = {}
    for stage in STAGES:
        if stage.wanted(recipe):
            records[stage.name] = stage.run(work, folders[stage.name])
            work = after(work, records[stage.name], folders[stage.name])
    return records


def _row(column: Column, derived: StoredColumn, rows: NDArray[np.intp]) -> bytes | None:
    """The bytes of the derived row as a batch has it, or None where there is none."""
    if not rows.size:
        return None
    stored = derived.row(int(rows[0]))[None]
    decoded = decode_rows(column, stored) if column.codec == "packed_bits" else stored
    return decoded.tobytes()
