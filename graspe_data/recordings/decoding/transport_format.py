"""The ``format`` of a CompressedImage: what was published, and what was stored of it.

compressed_image_transport writes ``<encoding>; <codec> compressed <stored as>``: the encoding of
the raw topic, then the pixels that it gave the codec. "bgr8" there means that OpenCV wrote a colour
file; "mono8", that it made a grey picture first, as newer versions do of a Bayer topic. Nothing, or
the encoding again, means that the pixels went in as they were: of a Bayer topic the mosaic.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

VIDEO: Final = {"h264": "h264", "h265": "hevc", "hevc": "hevc"}


@dataclass(frozen=True)
class TransportFormat:
    """The parts of a format; empty where it does not say.

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
