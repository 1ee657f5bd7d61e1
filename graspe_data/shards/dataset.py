"""Rows and batches of a dataset, mapped from its shards."""

from __future__ import annotations

import resource
from bisect import bisect_right
from collections.abc import Collection, Iterator, Sequence
from itertools import accumulate
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from graspe_data.columns import Column
from graspe_data.errors import ShardError
from graspe_data.links import check_link
from graspe_data.shards.aligned_npz import NpzMap
from graspe_data.shards.dataset_index import DatasetIndex, read_index
from graspe_data.shards.stored_columns import (
    Array,
    check_stored,
    decode_picture,
    decode_rows,
    has_varying_rows,
    member_names,
    stored_dtype,
)

Check = Literal["none", "crc", "sha256"]


class Dataset:
    """The rows of one split of a dataset, by index.

    Shards are mapped when a row of theirs is first asked for, and only the columns asked for are
    touched. Every array is then checked against ``dataset.json`` for dtype, shape and size; the
    contents are checked by ``check``: ``none`` (the default, since ``graspe dataset verify`` checks
    them all and a random order would read whole shards for single rows), ``crc``, or ``sha256``,
    both on the first touch of a shard. May be shared by threads, forked and pickled.

    Attributes:
        index: The content of ``dataset.json``.
        columns: The columns that rows and batches have.
    """

    def __init__(
        self,
        path: Path | str,
        split: str,
        columns: Collection[str] | None = None,
        *,
        decode: bool = True,
        check: Check = "none",
    ) -> None:
        """Open a split.

        Args:
            path: The dataset's folder.
            split: Such as ``train``.
            columns: Names of the columns wanted; None takes all.
            decode: Unpack bits and decode pictures to the declared dtype and shape. Without it
                rows come as stored; pictures as ``<name>.bytes`` (and, in a batch,
                ``<name>.offsets``).
            check: How contents are checked on the first touch.

        Raises:
            ShardError: No valid ``dataset.json`` there, no such split, or no such column.
        """
        self.path = Path(path)
        self.split = split
        self.index: DatasetIndex = read_index(self.path)
        self.columns = _choose(self.index, columns)
        self._decode = decode
        self._check = check
        self._shards = self.index.shards(split)
        self._starts = [0, *accumulate(shard.rows for shard in self._shards)]
        self._mapped: dict[int, dict[str, Array]] = {}
        self._most_mapped = _half_of_open_files()

    def __repr__(self) -> str:
        """Split, rows, columns and the beginning of the digest, for people."""
        names = ", ".join(column.name for column in self.columns)
        return (
            f"<Dataset {self.path} {self.split!r}: {len(self)} rows of {names}; "
            f"digest {self.digest[:12]}>"
        )

    def __len__(self) -> int:
        """Rows of the split."""
        return self._starts[-1]

    @property
    def digest(self) -> str:
        """The digest of the dataset: equal for equal rows in equal order, whatever the layout."""
        return self.index.dataset_digest

    def row(self, index: int) -> dict[str, Array]:
        """One row, each column in its shape, copied.

        Raises:
            IndexError: ``index`` is not in 0 .. len - 1.
            ShardError: As :meth:`batch`.
        """
        if not 0 <= index < len(self):
            raise IndexError(self._no_row(index))
        shard = bisect_right(self._starts, index) - 1
        arrays, local = self._arrays(shard), index - self._starts[shard]
        row: dict[str, Array] = {}
        for column in self.columns:
            if has_varying_rows(column):
                row |= self._picture(column, arrays, local)
            else:
                stored = arrays[column.name][local, ...].copy()
                row[column.name] = decode_rows(column, stored) if self._decode else stored
        return row

    __getitem__ = row

    def batch(self, indices: Sequence[int] | NDArray[np.integer[Any]]) -> dict[str, Array]:
        """Rows by index, in that order, each column gathered into one new array.

        Args:
            indices: (rows,), each in 0 .. len - 1; repeats are allowed.

        Returns:
            For each column an array (rows, *shape).

        Raises:
            IndexError: An index out of range.
            ShardError: A shard is missing, damaged, or not what ``dataset.json`` says.
        """
        places = self._locate(np.asarray(indices, dtype=np.int64))
        batch: dict[str, Array] = {}
        for column in self.columns:
            if has_varying_rows(column):
                batch |= self._gather_pictures(column, places)
            else:
                batch[column.name] = self._gather(column, places)
        return batch

    def check_shards(self) -> Iterator[int]:
        """Map every shard, so that its contents are checked as ``check`` says.

        Yields:
            The rows that were passed, after each shard.

        Raises:
            ShardError: As :meth:`batch`.
        """
        for shard, passed in enumerate(self._starts[1:]):
            self._map(shard)
            yield passed

    def __getstate__(self) -> dict[str, Any]:
        """Everything but the maps, which a copy opens again."""
        return self.__dict__ | {"_mapped": {}}

    def _locate(self, indices: NDArray[np.int64]) -> list[_Place]:
        """For each row its shard's arrays and its place in them."""
        outside = (indices < 0) | (indices >= len(self))
        if outside.any():
            raise IndexError(self._no_row(int(indices[outside][0])))
        starts = np.asarray(self._starts)
        shards = np.searchsorted(starts, indices, side="right") - 1
        local = (indices - starts[shards]).tolist()
        arrays = {shard: self._arrays(shard) for shard in set(shards.tolist())}
        return [(arrays[shard], row) for shard, row in zip(shards.tolist(), local, strict=True)]

    def _no_row(self, index: int) -> str:
        if not len(self):
            return f"row {index}: the split {self.split!r} has no rows"
        return f"row {index} is not in 0..{len(self) - 1} of the split {self.split!r}"

    def _gather(self, column: Column, places: list[_Place]) -> Array:
        name = column.name
        gathered = np.empty((len(places), *column.stored_shape), stored_dtype(column))
        for position, (arrays, row) in enumerate(places):
            gathered[position] = arrays[name][row]
        return decode_rows(column, gathered) if self._decode else gathered

    def _gather_pictures(self, column: Column, places: list[_Place]) -> dict[str, Array]:
        encoded = [_encoded(column, arrays, row) for arrays, row in places]
        if self._decode:
            pictures = np.empty((len(places), *column.shape), np.uint8)
            for position, content in enumerate(encoded):
                pictures[position] = decode_picture(column, content)
            return {column.name: pictures}
        bytes_name, offsets_name = member_names(column)
        sizes = [0, *(content.size for content in encoded)]
        content = np.concatenate([np.empty(0, np.uint8), *encoded])
        return {bytes_name: content, offsets_name: np.cumsum(sizes, dtype=np.int64)}

    def _picture(self, column: Column, arrays: dict[str, Array], row: int) -> dict[str, Array]:
        encoded = _encoded(column, arrays, row)
        if self._decode:
            return {column.name: decode_picture(column, encoded)}
        return {member_names(column)[0]: encoded.copy()}

    def _arrays(self, shard: int) -> dict[str, Array]:
        """The arrays of a shard, mapped and checked at the first call.

        Each map holds a file open, so no more are kept than half of what the process may open.
        """
        arrays = self._mapped.get(shard)
        if arrays is None:
            arrays = self._map(shard)
            if len(self._mapped) >= self._most_mapped:
                self._mapped.popitem()
            self._mapped[shard] = arrays
        return arrays

    def _map(self, shard: int) -> dict[str, Array]:
        entry = self._shards[shard]
        file = self.path / entry.path
        check_link(file, self.path, ShardError)
        mapped = NpzMap(file)
        if len(mapped) != entry.bytes:
            raise ShardError(
                f"{file}: expected {entry.bytes} bytes, found {len(mapped)}. "
                "Build the dataset again: it is made anew from the recordings."
            )
        arrays: dict[str, Array] = {}
        for column in self.columns:
            names = member_names(column)
            arrays |= {name: mapped.array(name) for name in names}
            check_stored(str(file), column, arrays, entry.rows)
            for name in names:
                self._check_content(mapped, name, entry.columns.get(name))
        return arrays

    def _check_content(self, mapped: NpzMap, name: str, expected: str | None) -> None:
        bad_crc = self._check == "crc" and not mapped.crc_matches(name)
        found = mapped.digest(name) if self._check == "sha256" else expected
        if bad_crc or found != expected:
            others = [shard.path for shard in self._shards if shard.columns.get(name) == found]
            whose = f" It is that of {others[0]}." if others and not bad_crc else ""
            raise ShardError(
                f"{mapped.path}: {name}: its {self._check} does not match.{whose} "
                "Run `graspe dataset verify` to see what else is damaged."
            )


_Place = tuple[dict[str, Array], int]


def _encoded(column: Column, arrays: dict[str, Array], row: int) -> Array:
    bytes_name, offsets_name = member_names(column)
    begin, end = arrays[offsets_name][row : row + 2].tolist()
    return arrays[bytes_name][begin:end]


def _choose(index: DatasetIndex, names: Collection[str] | None) -> tuple[Column, ...]:
    known = {column.name: column for column in index.columns}
    for name in [] if names is None else names:
        if name not in known:
            raise ShardError(f"{index.name}: no column {name!r}; it has {', '.join(known)}.")
    return tuple(column for column in index.columns if names is None or column.name in names)


def _half_of_open_files() -> int:
    allowed = resource.getrlimit(resource.RLIMIT_NOFILE)[0]
    return max(1, allowed // 2) if allowed != resource.RLIM_INFINITY else 1 << 16
