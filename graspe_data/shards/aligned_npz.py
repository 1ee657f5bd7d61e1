"""Plain ``.npz`` files whose arrays are aligned to 64 bytes, to be mapped in place."""

from __future__ import annotations

import hashlib
import math
import mmap
import re
import zlib
from collections.abc import Collection, Mapping
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from graspe_data.atomic_file import write_atomically
from graspe_data.errors import ShardError
from graspe_data.shards.npy_header import NpyHeader, npy_header, parse_npy_header
from graspe_data.shards.zip_container import StoredMember, container_pieces
from graspe_data.shards.zip_directory import Extent, read_directory

_NAME = re.compile(r"[A-Za-z0-9_][A-Za-z0-9_.-]{0,200}")
_HEADER_ROOM = 1 << 13


class NpzMap:
    """One mapped ``.npz``: its members are found on opening, their arrays when asked for.

    The arrays are read-only views of the file and keep it mapped while they live. The file may be
    replaced or deleted meanwhile, but must not be shortened in place.

    Raises:
        ShardError: The file is missing, or not a zip of stored ``.npy`` members.
    """

    def __init__(self, path: Path) -> None:
        """Map the file and read its directory."""
        self.path = path
        try:
            with path.open("rb") as file:
                self._file = mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ)
            self._extents = read_directory(self._file)
        except OSError as error:
            raise ShardError(f"{path}: cannot be opened: {error.strerror}. {_REPAIR}") from error
        except ValueError as error:
            raise ShardError(f"{path}: not a shard: {error}. {_REPAIR}") from error

    def __len__(self) -> int:
        """Bytes of the file."""
        return len(self._file)

    @property
    def names(self) -> set[str]:
        """The names of the members, without ``.npy``."""
        return {name.removesuffix(".npy") for name in self._extents}

    def array(self, name: str) -> NDArray[np.generic]:
        """The array of a member, mapped.

        Raises:
            ShardError: No such member, or one that is not a plain array of numbers of its size.
        """
        extent = self._extent(name)
        start = self._file[extent.offset : extent.offset + min(extent.size, _HEADER_ROOM)]
        try:
            return self._view(extent, parse_npy_header(start))
        except (ValueError, OverflowError) as error:
            raise ShardError(f"{self.path}: {name}: not an array: {error}. {_REPAIR}") from error

    def read(self, offset: int, size: int) -> bytes:
        """Bytes of the file itself; fewer at its end."""
        return self._file[offset : offset + size]

    def content(self, name: str) -> memoryview:
        """The bytes of a member: ``.npy`` header and data."""
        extent = self._extent(name)
        return memoryview(self._file)[extent.offset : extent.offset + extent.size]

    def digest(self, name: str) -> str:
        """SHA-256 of the bytes of a member, in hexadecimal."""
        return hashlib.sha256(self.content(name)).hexdigest()

    def crc_matches(self, name: str) -> bool:
        """Whether the CRC-32 of a member is that of the zip directory."""
        return zlib.crc32(self.content(name)) == self._extent(name).crc

    def _view(self, extent: Extent, header: NpyHeader) -> NDArray[np.generic]:
        room = extent.size - header.length
        if math.prod(header.shape) * header.dtype.itemsize != room:
            raise ValueError(f"shape {header.shape} of {header.dtype} does not fill {room} bytes")
        begin = extent.offset + header.length
        return np.ndarray(header.shape, header.dtype, self._file, begin, order=header.order)

    def _extent(self, name: str) -> Extent:
        try:
            return self._extents[f"{name}.npy"]
        except KeyError:
            known = ", ".join(sorted(self.names))
            raise ShardError(f"{self.path}: no array {name!r}; it has {known}.") from None


_REPAIR = "Run `graspe dataset verify` on the dataset, and build the shard again."


def map_npz(path: Path, names: Collection[str] | None = None) -> dict[str, NDArray[np.generic]]:
    """Map arrays of an ``.npz`` read-only, without reading them.

    Args:
        path: A file of :func:`write_npz`, or any ``.npz`` with stored members.
        names: The arrays to map; None maps all.

    Raises:
        ShardError: Names the file and the member that is missing, damaged, compressed, or not a
            plain array of numbers.
    """
    mapped = NpzMap(path)
    return {name: mapped.array(name) for name in (sorted(mapped.names) if names is None else names)}


def write_npz(
    path: Path, arrays: Mapping[str, NDArray[np.generic]], *, zip64: bool | None = None
) -> dict[str, str]:
    """Write arrays as an uncompressed ``.npz`` that ``numpy.load`` opens, atomically.

    The data of every array begins at a multiple of 64 bytes. Members lie in the order of their
    names with a fixed time, so the same arrays give the same bytes.

    Args:
        path: The file; one that exists is replaced as a whole.
        arrays: Booleans, integers and floats of at most 64 bits, any shape; stored in C order.
        zip64: Force or forbid 64-bit sizes; None takes them from 4 GiB on.

    Returns:
        For each array the SHA-256 of its ``.npy`` member (header and data), in hexadecimal.

    Raises:
        ShardError: A name or dtype that cannot be stored, or a file that cannot be written.
    """
    members = [_member(path, name, arrays[name]) for name in sorted(arrays)]
    # The digests are made while the disk takes the bytes.
    with ThreadPoolExecutor(1) as beside:
        digests = beside.map(_digest, members)
        write_atomically(path, container_pieces(members, zip64=zip64), ShardError)
    return dict(zip(sorted(arrays), digests, strict=True))


def npz_differs_at(mapped: NpzMap) -> int | None:
    """The first byte at which a file is not what :func:`write_npz` writes for its arrays.

    Raises:
        ShardError: A member is not an array.
    """
    members = [_member(mapped.path, name, mapped.array(name)) for name in sorted(mapped.names)]
    position = 0
    for piece in container_pieces(members):
        if isinstance(piece, bytes) and mapped.read(position, len(piece)) != piece:
            pairs = zip(mapped.read(position, len(piece)), piece, strict=False)
            return position + next((k for k, (a, b) in enumerate(pairs) if a != b), 0)
        position += len(piece)
    return None if position == len(mapped) else position


def _member(path: Path, name: str, array: NDArray[np.generic]) -> StoredMember:
    if not _NAME.fullmatch(name):
        raise ShardError(
            f"{path}: {name!r} cannot name an array: use letters, digits, '_', '.' and '-'."
        )
    try:
        header = npy_header(array)
    except ValueError as error:
        raise ShardError(f"{path}: {name}: {error}; convert it before it is written.") from error
    data = np.asarray(array, order="C").reshape(-1).view(np.uint8).data
    return StoredMember(f"{name}.npy", zlib.crc32(data, zlib.crc32(header)), (header, data))


def _digest(member: StoredMember) -> str:
    digest = hashlib.sha256()
    for buffer in member.buffers:
        digest.update(buffer)
    return digest.hexdigest()
