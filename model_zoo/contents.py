"""Whether a dataset holds what its digest names, and numbers where a model reads numbers."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from graspe_data.columns import Column
from graspe_data.errors import ZooError
from graspe_data.observation.catalogue import BY_NAME, Entry
from graspe_data.shards import Dataset

Tell = Callable[[str, int, int], None]
"""Is told of what is read, how many rows of it are done, and of how many."""


def check_contents(
    folder: Path, split: str, columns: Collection[str], tell: Tell | None = None
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
        tell: Is told of the rows whose shards were checked.

    Raises:
        ShardError: Names the shard and the column that is damaged, or in another's place.
    """
    rows = Dataset(folder, split, columns, check="sha256")
    for passed in rows.check_shards():
        if tell:
            tell(f"checking {split} shards", passed, len(rows))


COUNT, RECORDING = "point_count", "recording"
ROWS_AT_ONCE = 128


def check_values(dataset: Dataset, tell: Tell | None = None) -> None:
    """Read every float column of a dataset once and refuse what is not finite.

    Points past their row's count are padding, whatever they are; a ray without a return is inf.

    Args:
        dataset: A split with the columns that are to be checked. Where ``point_count`` is not
            among them, the padded columns may hold NaN.
        tell: Is told of the rows that were read.

    Raises:
        ShardError: A shard is missing or not what ``dataset.json`` says.
        ZooError: Names the first column and row that hold NaN, or an infinity that means nothing.
    """
    floats = [column for column in dataset.columns if np.dtype(column.dtype).kind == "f"]
    if not floats:
        return
    extra = {column.name for column in dataset.index.columns} & {COUNT}
    names = {column.name for column in floats} | extra
    most = min((c.shape[0] for c in floats if _entry(c).padded), default=None)
    reader = Dataset(dataset.path, dataset.split, names)
    for begin in range(0, len(reader), ROWS_AT_ONCE):
        end = min(begin + ROWS_AT_ONCE, len(reader))
        batch = reader.batch(np.arange(begin, end))
        if tell:
            tell(f"checking {dataset.split} rows", end, len(reader))
        if COUNT in batch and most is not None:
            _check_counts(dataset, batch[COUNT].astype(np.int64), most, begin)
        for column in floats:
            for row in _faulty_rows(column, batch):
                raise ZooError(_describe(dataset, column, begin + row))


def _entry(column: Column) -> Entry:
    """What the catalogue says of a column; of one that it does not have, nothing special."""
    plain = Entry(column.name, column.dtype, column.shape, column.unit, "", "", "extract")
    return BY_NAME.get(column.name, plain)


def _faulty_rows(column: Column, batch: dict[str, NDArray[np.generic]]) -> Iterator[int]:
    values = batch[column.name].astype(np.float32, copy=False)
    entry = _entry(column)
    sound = ~np.isnan(values) if entry.empty == "inf" else np.isfinite(values)
    if entry.share:
        sound &= (values >= 0) & (values <= 1)
    if entry.padded and COUNT in batch:
        counts = batch[COUNT].astype(np.int64)
        padding = np.arange(values.shape[1]) >= counts[:, None]
        sound |= padding.reshape(*padding.shape, *(1 for _ in values.shape[2:]))
    elif entry.padded:
        sound |= np.isnan(values)
    yield from np.flatnonzero(~sound.reshape(len(values), -1).all(axis=1)).tolist()


def _check_counts(dataset: Dataset, counts: NDArray[np.int64], most: int, first_row: int) -> None:
    for row in np.flatnonzero((counts < 0) | (counts > most)).tolist():
        raise ZooError(
            f"{dataset.path}: split {dataset.split!r}, row {first_row + row}"
            f"{_recording(dataset, first_row + row)}: column {COUNT} is {counts[row]}, expected 0 "
            f"to {most}. Build the dataset again."
        )


def _describe(dataset: Dataset, column: Column, row: int) -> str:
    return (
        f"{dataset.path}: split {dataset.split!r}, row {row}{_recording(dataset, row)}: column "
        f"{column.name} holds {_fault(column)}. "
        "Leave that recording out, or mend its sensor's data, and build the dataset again."
    )


def _fault(column: Column) -> str:
    if _entry(column).share:
        return "a number that is not finite, or outside of 0..1"
    return f"a number that is not finite, expected {column.unit or 'numbers'}"


def _recording(dataset: Dataset, row: int) -> str:
    if RECORDING not in {column.name for column in dataset.index.columns}:
        return ""
    place = Dataset(dataset.path, dataset.split, [RECORDING]).row(row)[RECORDING]
    recordings = dataset.index.recordings
    number = int(place)
    return f" (recording {recordings[number].name if 0 <= number < len(recordings) else number})"
