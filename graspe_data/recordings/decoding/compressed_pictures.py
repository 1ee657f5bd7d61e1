"""JPEG and PNG files as RGB pictures, told apart by their first bytes."""

from __future__ import annotations

from typing import Any, Final, cast

import cv2
import numpy as np
from numpy.typing import NDArray

from graspe_data.errors import RecordingError
from graspe_data.recordings.decoding.picture_limits import check_size

_PNG: Final = b"\x89PNG\r\n\x1a\n"
_JPEG: Final = b"\xff\xd8\xff"
_START_OF_SCAN: Final = b"\xff\xda"
_END_OF_IMAGE: Final = b"\xff\xd9"
# SOF0..SOF15, without DHT (C4), JPG (C8) and DAC (CC): ITU T.81, table B.1.
_START_OF_FRAME: Final = frozenset(range(0xC0, 0xD0)) - {0xC4, 0xC8, 0xCC}
_DEPTH_HEADER_BYTES: Final = 12


def decode_compressed(data: Any, where: str) -> NDArray[np.uint8]:
    """Decode a JPEG or PNG file, uint8 (N,), to RGB, uint8 (H, W, 3).

    Raises:
        RecordingError: Another format, a size beyond the limits, or a file that is cut or damaged;
            ``where`` is named.
    """
    content = bytes(data)
    if content.startswith(_JPEG):
        width, height = _jpeg_size(content, where)
    elif content.startswith(_PNG):
        width, height = _png_size(content, where)
    else:
        raise _unknown_format(content, where)
    check_size(width, height, where)
    flags = cv2.IMREAD_COLOR_RGB | cv2.IMREAD_IGNORE_ORIENTATION
    try:
        picture = cv2.imdecode(np.frombuffer(content, np.uint8), flags)
    except cv2.error as error:
        raise _damaged(where, error.err) from error
    if picture is None:
        raise _damaged(where, f"a {width}x{height} picture was announced and none decoded")
    return cast("NDArray[np.uint8]", picture)


def _jpeg_size(content: bytes, where: str) -> tuple[int, int]:
    """Width and height from the first frame header, ITU T.81 B.2.2; refuses a file that is cut."""
    end = content.rfind(_END_OF_IMAGE)
    if end < 0 or content.find(_START_OF_SCAN, end) >= 0:
        raise _damaged(where, "a JPEG without its end marker: the file is cut")
    position = 2
    while position + 9 <= len(content) and content[position] == 0xFF:  # noqa: PLR2004
        marker = content[position + 1]
        if marker in _START_OF_FRAME:
            height = int.from_bytes(content[position + 5 : position + 7], "big")
            width = int.from_bytes(content[position + 7 : position + 9], "big")
            return width, height
        fill = marker == 0xFF  # noqa: PLR2004
        length = int.from_bytes(content[position + 2 : position + 4], "big")
        position += 1 if fill else 2 + length
    raise _damaged(where, "a JPEG without a frame header")


def _png_size(content: bytes, where: str) -> tuple[int, int]:
    """Width and height from IHDR, which is always the first chunk."""
    if content[12:16] != b"IHDR" or len(content) < 24:  # noqa: PLR2004
        raise _damaged(where, "a PNG without its IHDR chunk")
    return int.from_bytes(content[16:20], "big"), int.from_bytes(content[20:24], "big")


def _unknown_format(content: bytes, where: str) -> RecordingError:
    if content.startswith(_PNG, _DEPTH_HEADER_BYTES):
        return RecordingError(
            f"{where}: a depth image (compressedDepth), not a picture: its PNG begins after a "
            f"header of {_DEPTH_HEADER_BYTES} bytes. Name the colour topic as `image`."
        )
    found = content[:8].hex(" ") or "no bytes"
    return RecordingError(
        f"{where}: neither a JPEG (ff d8 ff) nor a PNG (89 50 4e 47): it begins with {found}. "
        f"Only these two are read; the message is damaged or holds another format."
    )


def _damaged(where: str, what: str) -> RecordingError:
    return RecordingError(f"{where}: the compressed picture is damaged: {what}. It is left out.")
