"""Write rows as one shard."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from graspe_data.columns import Column
from graspe_data.errors import ShardError
from graspe_data.manifest import validate
from graspe_data.shards.aligned_npz import write_npz
from graspe_data.shards.dataset_index import ShardFile
from graspe_data.shards.stored_columns import check_stored, member_names


def write_shard(
    folder: Path,
    path: str,
    columns: Sequence[Column],
    arrays: Mapping[str, NDArray[np.generic]],
) -> ShardFile:
    """Write one shard of a dataset, atomically.

    Args:
        folder: The dataset's folder.
        path: The shard's path in it, with ``/``; folders on the way are made.
        columns: The declarations of all columns.
        arrays: The stored rows of each: under the column's name (rows, *stored_shape), or for
            ``png`` and ``jpeg`` as ``<name>.bytes`` uint8 (total,) and ``<name>.offsets`` int64
            (rows + 1,).

    Returns:
        The shard's entry for ``dataset.json``.

    Raises:
        ShardError: Arrays missing, undeclared, or not as declared; or the disk refuses.
        ManifestError: ``path`` leaves the folder.
    """
    expected = {name for column in columns for name in member_names(column)}
    if arrays.keys() != expected:
        wrong = ", ".join(sorted(arrays.keys() ^ expected))
        raise ShardError(f"{path}: arrays and declared columns differ in: {wrong}.")
    rows = _count_rows(columns, arrays)
    for column in columns:
        check_stored(path, column, arrays, rows)
    entry = validate({"path": path, "rows": rows, "bytes": 0, "columns": {}}, ShardFile, path)
    file = folder / path
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ShardError(f"{file.parent}: cannot be made: {error.strerror}.") from error
    digests = write_npz(file, arrays)
    return entry.model_copy(update={"bytes": file.stat().st_size, "columns": digests})


def _count_rows(columns: Sequence[Column], arrays: Mapping[str, NDArray[np.generic]]) -> int:
    if not columns:
        return 0
    last = member_names(columns[0])[-1]
    length = arrays[last].shape[0] if arrays[last].ndim else 0
    return max(0, length - 1) if last.endswith(".offsets") else length
