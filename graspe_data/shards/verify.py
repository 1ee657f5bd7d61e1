"""Check every byte of a dataset against its index."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from graspe_data.columns import Column
from graspe_data.errors import ShardError
from graspe_data.links import check_link
from graspe_data.shards.aligned_npz import NpzMap, npz_differs_at
from graspe_data.shards.dataset_index import DatasetIndex, ShardFile, read_index
from graspe_data.shards.stored_columns import check_stored, member_names


@dataclass(frozen=True)
class Fault:
    """Something in a dataset that is not as its index says.

    Attributes:
        split: The split of the shard.
        shard: The shard's path in the dataset's folder.
        column: The stored array at fault; None where it is the file itself.
        expected: What the index says.
        found: What is there.
    """

    split: str
    shard: str
    column: str | None
    expected: str
    found: str

    def __str__(self) -> str:
        """One line for people."""
        where = f"{self.shard}: {self.column}" if self.column else self.shard
        return f"{where}: expected {self.expected}, found {self.found}"


def verify_dataset(path: Path) -> list[Fault]:
    """Read every shard of a dataset and list what is not as ``dataset.json`` says.

    Every byte counts: the contents by their SHA-256, and headers, padding and directory by
    comparison with the ones that the contents would be written under. Memory does not grow with
    the dataset.

    Returns:
        The faults in the order of splits and shards; none when the dataset is sound.

    Raises:
        ShardError: ``dataset.json`` itself is missing, not valid, or does not fit its own digest.
    """
    index = read_index(path)
    return [
        fault
        for split in sorted(index.splits)
        for shard in index.splits[split]
        for fault in verify_shard(path, index, split, shard)
    ]


def verify_shard(path: Path, index: DatasetIndex, split: str, shard: ShardFile) -> list[Fault]:
    """The faults of one shard, as :func:`verify_dataset`; for progress bars and many processes."""
    try:
        check_link(path / shard.path, path, ShardError)
        mapped = NpzMap(path / shard.path)
    except ShardError as error:
        return [Fault(split, shard.path, None, "a shard", str(error))]
    faults = [
        Fault(split, shard.path, *parts)
        for parts in (*_bad_size(mapped, shard), *_bad_columns(mapped, index, shard))
    ]
    if not faults and (offset := npz_differs_at(mapped)) is not None:
        found = f"another byte at {offset}, in a header or the padding"
        faults.append(Fault(split, shard.path, None, "the file as it was written", found))
    return faults


_Parts = tuple[str | None, str, str]


def _bad_size(mapped: NpzMap, shard: ShardFile) -> Iterator[_Parts]:
    if len(mapped) != shard.bytes:
        yield None, f"{shard.bytes} bytes", f"{len(mapped)} bytes"


def _bad_columns(mapped: NpzMap, index: DatasetIndex, shard: ShardFile) -> Iterator[_Parts]:
    declared = {name for column in index.columns for name in member_names(column)}
    for name in sorted(declared | mapped.names | shard.columns.keys()):
        if name not in declared:
            yield name, "no such column", "an array that no column declares"
        elif name not in mapped.names:
            yield name, "an array", "none"
        elif mapped.digest(name) != shard.columns.get(name):
            yield name, f"SHA-256 {shard.columns.get(name)}", f"SHA-256 {mapped.digest(name)}"
    if declared <= mapped.names:
        for column in index.columns:
            yield from _bad_shape(mapped, column, shard.rows)


def _bad_shape(mapped: NpzMap, column: Column, rows: int) -> Iterator[_Parts]:
    try:
        arrays = {name: mapped.array(name) for name in member_names(column)}
        check_stored(str(mapped.path), column, arrays, rows)
    except ShardError as error:
        yield column.name, f"{rows} rows as declared", str(error)
