"""The columns of one recording between stages: one plain ``.npy`` a column, written row by row."""

from __future__ import annotations

import hashlib
import io
import math
import os
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from graspe_data.columns import Column
from graspe_data.errors import StageError

_NOT_IN_ORDER = -1


class ColumnFile:
    """A ``.npy`` file whose rows are written in any order, a row in memory at a time.

    Rows that come in their order are hashed as they are written.
    """

    def __init__(self, folder: Path, column: Column, rows: int) -> None:
        """Create the file with a header for ``rows`` rows."""
        self.column, self.rows = column, rows
        self._dtype = np.dtype(column.dtype)
        self._row_bytes = column.row_bytes
        self._file = (folder / f"{column.name}.npy").open("w+b", buffering=0)
        header = self._write_header(rows)
        self._start = len(header)
        self._sha256, self._hashed_rows = hashlib.sha256(header), 0
        self._file.truncate(self._start + rows * self._row_bytes)

    def write(self, row: int, values: NDArray[np.generic] | float) -> None:
        """Write one row, or several that follow one another."""
        array = np.ascontiguousarray(values, self._dtype)
        if array.nbytes % self._row_bytes or not 0 <= row < self.rows:
            raise StageError(
                f"column {self.column.name}: row {row} of shape {array.shape} does not fit "
                f"{self.rows} rows of {self.column.stored_shape}."
            )
        if os.pwrite(self._file.fileno(), array.data, self._offset(row)) != array.nbytes:
            raise StageError(f"{self._file.name}: row {row} was written in part: is the disk full?")
        if row == self._hashed_rows:
            self._sha256.update(array.data)
            self._hashed_rows += array.nbytes // self._row_bytes
        else:
            self._hashed_rows = _NOT_IN_ORDER

    def keep(self, rows: NDArray[np.intp]) -> None:
        """Drop all rows but these, which must ascend."""
        descriptor, size = self._file.fileno(), self._row_bytes
        for target, row in enumerate(rows.tolist()):
            if target != row:
                os.pwrite(
                    descriptor, os.pread(descriptor, size, self._offset(row)), self._offset(target)
                )
        self.rows, self._hashed_rows = int(rows.size), _NOT_IN_ORDER
        self._write_header(self.rows)
        self._file.truncate(self._offset(self.rows))

    def digest(self) -> str:
        """SHA-256 of the file."""
        if self._hashed_rows == self.rows:
            return self._sha256.hexdigest()
        self._file.seek(0)
        return hashlib.file_digest(self._file, "sha256").hexdigest()

    def close(self) -> None:
        """Close the file."""
        self._file.close()

    def _offset(self, row: int) -> int:
        return self._start + row * self._row_bytes

    def _write_header(self, rows: int) -> bytes:
        content = {
            "descr": np.lib.format.dtype_to_descr(self._dtype),
            "fortran_order": False,
            "shape": (rows, *self.column.stored_shape),
        }
        header = io.BytesIO()
        np.lib.format.write_array_header_1_0(header, content)
        os.pwrite(self._file.fileno(), header.getvalue(), 0)
        return header.getvalue()


class EpisodeWriter:
    """The column files of one stage of one recording."""

    def __init__(self, folder: Path, columns: Iterable[Column], rows: int) -> None:
        """Create a file for each column."""
        self.rows = rows
        self._files = {column.name: ColumnFile(folder, column, rows) for column in columns}

    def write(self, row: int, values: Mapping[str, NDArray[np.generic] | float]) -> None:
        """Write the named columns of one row."""
        for name, value in values.items():
            self._files[name].write(row, value)

    def write_all(self, name: str, values: NDArray[np.generic]) -> None:
        """Write a whole column."""
        if self.rows:
            self._files[name].write(0, values)

    def keep(self, rows: NDArray[np.intp]) -> None:
        """Drop all rows but these from every column."""
        self.rows = int(rows.size)
        for file in self._files.values():
            file.keep(rows)

    def digests(self) -> dict[str, str]:
        """SHA-256 of each column's file."""
        return {name: file.digest() for name, file in sorted(self._files.items())}

    def __enter__(self) -> Self:
        """Use as a context manager."""
        return self

    def __exit__(self, *error: object) -> None:
        """Close all files."""
        for file in self._files.values():
            file.close()


class StoredColumn:
    """A column of a finished stage, read row by row: nothing of it stays in memory.

    Raises:
        StageError: The file is missing, or not a plain array.
    """

    def __init__(self, folder: Path, name: str) -> None:
        """Open the file and read its header."""
        path = folder / f"{name}.npy"
        try:
            self._file = path.open("rb", buffering=0)
            np.lib.format.read_magic(self._file)
            header = np.lib.format.read_array_header_1_0(self._file)
        except (OSError, ValueError) as error:
            raise StageError(
                f"{path}: cannot be read: {error}. Delete {folder} and build again."
            ) from error
        (self.rows, *row), _, self._dtype = header
        self._shape = tuple(row)
        self._row_bytes = math.prod(row) * self._dtype.itemsize
        self._start = self._file.tell()

    def row(self, row: int) -> NDArray[Any]:
        """One row."""
        values = np.empty(self._shape, self._dtype)
        self.read_into(values, row)
        return values

    def read_into(self, target: NDArray[Any], row: int) -> None:
        """Read the rows from ``row`` on into a contiguous array, as many as it holds."""
        buffer = target.reshape(-1).view(np.uint8)
        offset = self._start + row * self._row_bytes
        if os.preadv(self._file.fileno(), [buffer.data], offset) != buffer.size:
            raise StageError(f"{self._file.name}: ends before row {row}: build again.")

    def all(self) -> NDArray[Any]:
        """The whole column, for columns of a few bytes a row."""
        values = np.empty((self.rows, *self._shape), self._dtype)
        self.read_into(values, 0)
        return values

    def __enter__(self) -> Self:
        """Use as a context manager."""
        return self

    def __exit__(self, *error: object) -> None:
        """Close the file."""
        self._file.close()


def whole_column(folder: Path, name: str) -> NDArray[Any]:
    """Read a whole column of a finished stage, one of a few bytes a row."""
    with StoredColumn(folder, name) as column:
        return column.all()
