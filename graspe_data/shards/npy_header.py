"""The header of a ``.npy`` array: numbers only, C order written, both orders read."""

from __future__ import annotations

import re
import struct
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

ALIGNMENT = 64
_MAGIC = b"\x93NUMPY"
_LONGEST = 1 << 12
_SHORTEST = 12
_NUMBERS = re.compile(r"\|b1|[<>|][iu]1|[<>][iu][248]|[<>]f[248]")
_HEADER = re.compile(
    rb"\{'descr': '([^']{3})', 'fortran_order': (False|True), "
    rb"'shape': \(((?:\d{1,18},(?: (?=\d))?){0,64}\d{0,18})\), \} *\n"
)


@dataclass(frozen=True)
class NpyHeader:
    """What a ``.npy`` header says: dtype, shape, order, and its own length in bytes."""

    dtype: np.dtype[np.generic]
    shape: tuple[int, ...]
    order: Literal["C", "F"]
    length: int


def npy_header(array: NDArray[np.generic]) -> bytes:
    """The version 1.0 header of an array in C order, padded to a multiple of 64 bytes.

    Raises:
        ValueError: The dtype is not a boolean, integer or float of at most 8 bytes.
    """
    descr = array.dtype.str
    if not _NUMBERS.fullmatch(descr):
        raise ValueError(f"dtype {array.dtype} is not one of bool, int, uint, float up to 64 bits")
    text = f"{{'descr': '{descr}', 'fortran_order': False, 'shape': {array.shape}, }}"
    length = -(-(len(_MAGIC) + 4 + len(text) + 1) // ALIGNMENT) * ALIGNMENT
    padded = text.ljust(length - len(_MAGIC) - 5) + "\n"
    return _MAGIC + struct.pack("<BBH", 1, 0, len(padded)) + padded.encode("ascii")


def parse_npy_header(start: bytes) -> NpyHeader:
    """Read the header at the start of a ``.npy`` file, without evaluating anything.

    Raises:
        ValueError: Not a header, or of an array that is not plain numbers.
    """
    if start[:6] != _MAGIC or len(start) < _SHORTEST or start[6] not in (1, 2, 3):
        raise ValueError("no .npy header of version 1 to 3")
    width, kind = (2, "<H") if start[6] == 1 else (4, "<I")
    (text_length,) = struct.unpack_from(kind, start, 8)
    begin = 8 + width
    if text_length > _LONGEST or begin + text_length > len(start):
        raise ValueError(f"a .npy header of {text_length} bytes does not fit")
    match = _HEADER.fullmatch(start, begin, begin + text_length)
    if match is None or not _NUMBERS.fullmatch(match[1].decode("latin-1")):
        raise ValueError("the .npy header does not describe a plain array of numbers")
    shape = tuple(int(size) for size in match[3].replace(b" ", b"").split(b",") if size)
    dtype = np.dtype(match[1].decode("ascii"))
    return NpyHeader(dtype, shape, "F" if match[2] == b"True" else "C", begin + text_length)
