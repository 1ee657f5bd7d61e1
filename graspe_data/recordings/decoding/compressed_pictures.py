"""JPEG and PNG files as RGB pictures, told apart by their first bytes and their format text."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final, NamedTuple, cast

import cv2
import numpy as np
from numpy.typing import NDArray

from graspe_data.errors import RecordingError
from graspe_data.recordings.decoding.picture_encodings import (
    ENCODINGS,
    check_size,
    depth_refusal,
    eight_bits,
    refuse_measures,
    to_rgb,
)

VIDEO: Final = {"h264": "h264", "h265": "hevc", "hevc": "hevc"}


@dataclass(frozen=True)
class TransportFormat:
    """The parts of a CompressedImage's ``format``; empty where it does not say.

    compressed_image_transport writes ``<encoding>; <codec> compressed <stored as>``: the encoding
    of the raw topic, then the pixels that it gave the codec. "bgr8" there means that OpenCV wrote a
    colour file; "mono8", that it made a grey picture first, as newer versions do of a Bayer topic.
    Nothing, or the encoding again, means that the pixels went in as they were: of a Bayer topic the
    mosaic.

    ``encoding`` is that of the raw topic, or a codec where other writers give only that;
    ``stored_as`` is that of the pixels in the file; ``depth`` tells a compressedDepth topic.
    """

    encoding: str
    stored_as: str
    depth: bool

    @property
    def mosaic(self) -> bool:
        """Whether a file of one channel is the mosaic of a Bayer topic."""
        if self.stored_as:
            return self.stored_as.startswith("bayer_")
        return self.encoding.startswith("bayer_")


def transport_format(text: str) -> TransportFormat:
    """Take a format apart; any text has parts."""
    encoding, _, rest = text.partition(";")
    codec, _, stored_as = rest.partition("compressed ")
    depth = "compresseddepth" in text.lower()
    return TransportFormat(
        encoding.strip(),
        "" if depth or not codec.strip() else stored_as.strip(),
        depth,
    )


def video_codec(text: str) -> str | None:
    """FFmpeg's name of the codec that a format such as ``h264`` names; None where it names none."""
    return VIDEO.get(text.partition(";")[0].strip().lower())


_PNG: Final = b"\x89PNG\r\n\x1a\n"
_JPEG: Final = b"\xff\xd8\xff"
_START_OF_SCAN: Final = b"\xff\xda"
_END_OF_IMAGE: Final = b"\xff\xd9"
# SOF0..SOF15, without DHT (C4), JPG (C8) and DAC (CC): ITU T.81, table B.1.
_START_OF_FRAME: Final = frozenset(range(0xC0, 0xD0)) - {0xC4, 0xC8, 0xCC}
_DEPTH_HEADER_BYTES: Final = 12
# PNG's colour types without colour: grey, and grey with alpha.
_GREY_TYPES: Final = (0, 4)
_COLOUR: Final = cv2.IMREAD_COLOR_RGB | cv2.IMREAD_IGNORE_ORIENTATION
_GREY: Final = cv2.IMREAD_GRAYSCALE | cv2.IMREAD_IGNORE_ORIENTATION


class _File(NamedTuple):
    """What the header of a file announces."""

    width: int
    height: int
    grey: bool
    bits: int


def decode_compressed(data: Any, format_text: str, where: str) -> NDArray[np.uint8]:
    """Decode a JPEG or PNG file, uint8 (N,), to RGB, uint8 (H, W, 3).

    Args:
        data: The file.
        format_text: The message's ``format``; it says whether a file of one channel is a grey
            picture, a mosaic or a depth image. The kind of file is told by its bytes.
        where: Named in errors.

    Raises:
        RecordingError: Another format, a depth image, a size beyond the limits, or a file that is
            cut or damaged.
    """
    content = bytes(data)
    transport = transport_format(format_text)
    refuse_measures(transport.encoding, where)
    if transport.depth:
        raise depth_refusal(where, f"format {format_text!r}")
    file = _announced(content, format_text, where)
    check_size(file.width, file.height, where)
    if file.grey and transport.mosaic:
        return _demosaiced(content, file, transport, where)
    _refuse_unsaid(file, transport, format_text, where)
    return eight_bits(_read(content, file, _COLOUR, where))


def _demosaiced(
    content: bytes, file: _File, transport: TransportFormat, where: str
) -> NDArray[np.uint8]:
    word = transport.stored_as or transport.encoding
    if word not in ENCODINGS:
        known = ", ".join(name for name in ENCODINGS if name.startswith("bayer_"))
        raise RecordingError(
            f"{where}: a mosaic of encoding {word!r} is not supported; expected one of {known}. "
            f"Convert the topic, or name another as `image`."
        )
    return to_rgb(_read(content, file, _GREY, where), word, where)


def _refuse_unsaid(file: _File, transport: TransportFormat, format_text: str, where: str) -> None:
    """Refuse a grey file that the format does not explain."""
    if not file.grey:
        return
    if transport.encoding.startswith("bayer_") and transport.stored_as[:3] in ("bgr", "rgb"):
        raise RecordingError(
            f"{where}: format {format_text!r} says that colour was stored, and the file has one "
            f"channel: it may be a mosaic or a grey picture. Name the raw topic as `image`, or "
            f"correct the format that the driver writes."
        )
    if file.bits > 8 and transport.encoding not in ENCODINGS:  # noqa: PLR2004
        raise depth_refusal(where, f"a PNG of one channel and 16 bits with format {format_text!r}")


def _read(content: bytes, file: _File, flags: int, where: str) -> NDArray[np.uint8 | np.uint16]:
    flags |= cv2.IMREAD_ANYDEPTH if file.bits > 8 else 0  # noqa: PLR2004
    try:
        picture = cv2.imdecode(np.frombuffer(content, np.uint8), flags)
    except cv2.error as error:
        raise _damaged(where, error.err) from error
    if picture is None:
        size = f"{file.width}x{file.height}"
        raise _damaged(where, f"a {size} picture was announced and none decoded")
    return cast("NDArray[np.uint8 | np.uint16]", picture)


def _announced(content: bytes, format_text: str, where: str) -> _File:
    if content.startswith(_JPEG):
        return _jpeg_header(content, where)
    if content.startswith(_PNG):
        return _png_header(content, where)
    raise _unknown_format(content, format_text, where)


def _jpeg_header(content: bytes, where: str) -> _File:
    """The first frame header, ITU T.81 B.2.2; refuses a file that is cut."""
    end = content.rfind(_END_OF_IMAGE)
    if end < 0 or content.find(_START_OF_SCAN, end) >= 0:
        raise _damaged(where, "a JPEG without its end marker: the file is cut")
    position = 2
    while position + 10 <= len(content) and content[position] == 0xFF:  # noqa: PLR2004
        marker = content[position + 1]
        if marker in _START_OF_FRAME:
            bits, components = content[position + 4], content[position + 9]
            height = int.from_bytes(content[position + 5 : position + 7], "big")
            width = int.from_bytes(content[position + 7 : position + 9], "big")
            return _File(width, height, components == 1, bits)
        fill = marker == 0xFF  # noqa: PLR2004
        length = int.from_bytes(content[position + 2 : position + 4], "big")
        position += 1 if fill else 2 + length
    raise _damaged(where, "a JPEG without a frame header")


def _png_header(content: bytes, where: str) -> _File:
    """IHDR, which is always the first chunk."""
    if content[12:16] != b"IHDR" or len(content) < 26:  # noqa: PLR2004
        raise _damaged(where, "a PNG without its IHDR chunk")
    width, height = (int.from_bytes(content[at : at + 4], "big") for at in (16, 20))
    return _File(width, height, content[25] in _GREY_TYPES, content[24])


def _unknown_format(content: bytes, format_text: str, where: str) -> RecordingError:
    if content.startswith(_PNG, _DEPTH_HEADER_BYTES):
        header = f"a PNG after a header of {_DEPTH_HEADER_BYTES} bytes (compressedDepth)"
        return depth_refusal(where, header)
    found = content[:8].hex(" ") or "no bytes"
    if video_codec(format_text):
        return RecordingError(
            f"{where}: format {format_text!r} names a video, of which one message alone gives no "
            f"picture; it begins with {found}. A dataset build reads videos from their first "
            f"message on; here, name a topic of pictures as `image`."
        )
    return RecordingError(
        f"{where}: neither a JPEG (ff d8 ff) nor a PNG (89 50 4e 47): it begins with {found}, and "
        f"its format is {format_text!r}. Only these two are read; the message is damaged or holds "
        f"another format."
    )


def _damaged(where: str, what: str) -> RecordingError:
    return RecordingError(f"{where}: the compressed picture is damaged: {what}. It is left out.")
