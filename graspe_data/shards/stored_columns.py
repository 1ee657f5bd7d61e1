"""How a column lies in a shard: the arrays it is stored as, and the way back to its rows."""

from __future__ import annotations

from collections.abc import Mapping

import cv2
import numpy as np
from numpy.typing import NDArray

from graspe_data.columns import Column
from graspe_data.errors import ShardError

Array = NDArray[np.generic]

_PICTURE_CODECS = frozenset({"png", "jpeg"})


def has_varying_rows(column: Column) -> bool:
    """Whether rows are stored as byte strings, with offsets beside them."""
    return column.codec in _PICTURE_CODECS


def member_names(column: Column) -> tuple[str, ...]:
    """The arrays of a column: its own name, or ``.bytes`` and ``.offsets`` where rows vary."""
    if has_varying_rows(column):
        return f"{column.name}.bytes", f"{column.name}.offsets"
    return (column.name,)


def stored_dtype(column: Column) -> np.dtype[np.generic]:
    """The dtype on disk of a column of a fixed size."""
    return np.dtype(np.uint8) if column.codec == "packed_bits" else np.dtype(column.dtype)


def check_stored(where: str, column: Column, arrays: Mapping[str, Array], rows: int) -> None:
    """Check the arrays of a column against its declaration.

    Args:
        where: The shard, for the error.
        column: The declaration.
        arrays: Its arrays under :func:`member_names`.
        rows: Rows of the shard.

    Raises:
        ShardError: A wrong dtype or shape, or offsets that do not fit the bytes.
    """
    if not has_varying_rows(column):
        shape = (rows, *column.stored_shape)
        _expect(where, column.name, arrays[column.name], stored_dtype(column), shape)
        return
    content, offsets = (arrays[name] for name in member_names(column))
    _expect(where, f"{column.name}.bytes", content, np.dtype(np.uint8), (content.size,))
    _expect(where, f"{column.name}.offsets", offsets, np.dtype(np.int64), (rows + 1,))
    steps = np.diff(offsets.astype(np.int64))
    if offsets[0] != 0 or offsets[-1] != content.size or (steps < 0).any():
        raise ShardError(
            f"{where}: {column.name}.offsets: expected to rise from 0 to {content.size}, the "
            "bytes stored; they do not."
        )


def decode_rows(column: Column, stored: Array) -> Array:
    """Undo a codec of a fixed size: (rows, *stored_shape) to (rows, *shape)."""
    if column.codec != "packed_bits":
        return stored
    bits = np.unpackbits(stored.astype(np.uint8, copy=False), axis=-1, count=column.shape[-1])
    return bits.astype(column.dtype, copy=False)


def decode_picture(column: Column, encoded: Array) -> NDArray[np.uint8]:
    """Decode one PNG or JPEG row to RGB or grey, as the declared shape has it.

    Raises:
        ShardError: It does not decode, or not to the declared shape.
    """
    flag = cv2.IMREAD_COLOR_RGB if len(column.shape) == 3 else cv2.IMREAD_GRAYSCALE  # noqa: PLR2004
    picture = cv2.imdecode(encoded.astype(np.uint8, copy=False), flag) if encoded.size else None
    if picture is None or picture.shape != column.shape:
        found = "no picture" if picture is None else str(picture.shape)
        raise ShardError(
            f"{column.name}: expected a {column.codec} of {column.shape}, found {found}."
        )
    return picture.astype(np.uint8, copy=False)


def _expect(
    where: str, name: str, array: Array, dtype: np.dtype[np.generic], shape: tuple[int, ...]
) -> None:
    if array.dtype != dtype or array.shape != shape:
        found = f"{array.dtype} {array.shape}"
        raise ShardError(f"{where}: {name}: expected {dtype} {shape}, found {found}.")
