"""Decompression that gives no more than declared, and of a cut stream what it holds."""

from __future__ import annotations

import bz2
import io
from collections.abc import Callable, Iterator
from pathlib import Path

import lz4.frame
import zstandard

from graspe_data.errors import RecordingError

MAXIMUM_SIZE = 1 << 30
EXPANSION = 1000
FLOOR = 64 << 20
PIECE = 1 << 16
ZSTD_MAGIC = b"\x28\xb5\x2f\xfd"


def decompress(data: bytes, compression: str, declared: int) -> tuple[bytes, str | None]:
    """Decompress one chunk.

    Args:
        data: The compressed bytes, cut short perhaps.
        compression: ``none`` or empty, ``bz2``, ``lz4``, ``zstd``.
        declared: The size that the recording says; no more comes out.

    Returns:
        What came out, and what is wrong with it or None.
    """
    if compression in ("", "none"):
        short = f"has {len(data)} of {declared} bytes" if len(data) < declared else None
        return data[:declared], short
    if compression not in ("bz2", "lz4", "zstd"):
        return b"", f"has the unknown compression {compression[:20]!r}"
    if declared > min(MAXIMUM_SIZE, max(FLOOR, EXPANSION * len(data))):
        return b"", f"claims {declared} bytes from {len(data)} compressed ones"
    if compression == "zstd":
        return _collect(_zstd_pieces(data, declared), declared)
    return _collect(_stream_pieces(data, compression, declared), declared)


def decompress_message(data: bytes | memoryview) -> bytes:
    """Decompress the zstd payload of one message.

    Raises:
        ValueError: It is damaged, or larger than a message may be.
    """
    try:
        declared = zstandard.frame_content_size(data)
    except zstandard.ZstdError as error:
        raise ValueError(f"the zstd payload is damaged ({error})") from error
    known = declared >= 0
    content, fault = decompress(bytes(data), "zstd", declared if known else FLOOR)
    if fault is not None and (known or not fault.startswith("gives")):
        raise ValueError(f"the zstd payload {fault}")
    return content


def decompress_file(path: Path, target: Path) -> str | None:
    """Decompress a zstd file to another; returns what is wrong with it or None.

    Raises:
        RecordingError: A file cannot be read or written.
    """
    written = 0
    try:
        limit = max(FLOOR, EXPANSION * path.stat().st_size)
        with path.open("rb") as source, target.open("wb") as out:
            reader = zstandard.ZstdDecompressor().stream_reader(source, read_across_frames=True)
            while piece := reader.read(PIECE):
                out.write(piece)
                written += len(piece)
                if written > limit:
                    return f"expands to more than {limit} bytes, so it is cut there"
    except zstandard.ZstdError as error:
        return f"is damaged after {written} decompressed bytes ({error})"
    except OSError as error:
        raise RecordingError(f"{path}: cannot be decompressed to {target}: {error}") from error
    return None


def _collect(pieces: Iterator[bytes], declared: int) -> tuple[bytes, str | None]:
    try:
        got = list(pieces)
    except Exception as error:  # noqa: BLE001 - three libraries, each with errors of its own
        return b"", f"does not decompress ({error or type(error).__name__})"
    content = got[0] if len(got) == 1 else b"".join(got)
    short = len(content) < declared
    return content, f"gives {len(content)} of {declared} declared bytes" if short else None


def _stream_pieces(data: bytes, compression: str, limit: int) -> Iterator[bytes]:
    decoder = bz2.BZ2Decompressor() if compression == "bz2" else lz4.frame.LZ4FrameDecompressor()
    inflate: Callable[..., bytes] = decoder.decompress
    while limit > 0 and not decoder.eof:
        content = inflate(data, max_length=limit)
        if not content:
            return
        yield content
        limit -= len(content)
        data = b""


def _zstd_pieces(data: bytes, limit: int) -> Iterator[bytes]:
    reader = zstandard.ZstdDecompressor().stream_reader(io.BytesIO(data), read_size=len(data))
    while limit > 0 and (piece := reader.read(limit)):
        yield piece
        limit -= len(piece)
