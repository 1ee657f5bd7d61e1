"""Pixels as ROS names their encodings, brought to RGB of eight bits; and how large they may be."""

from __future__ import annotations

from typing import Any, Final, NamedTuple, cast

import cv2
import numpy as np
from numpy.typing import NDArray

from graspe_data.errors import RecordingError


class Encoding(NamedTuple):
    """Bytes and channels of a pixel, and OpenCV's conversion to RGB; None copies."""

    depth: int
    channels: int
    conversion: int | None


ENCODINGS: Final = {
    "rgb8": Encoding(1, 3, None),
    "bgr8": Encoding(1, 3, cv2.COLOR_BGR2RGB),
    "rgba8": Encoding(1, 4, cv2.COLOR_RGBA2RGB),
    "bgra8": Encoding(1, 4, cv2.COLOR_BGRA2RGB),
    "mono8": Encoding(1, 1, cv2.COLOR_GRAY2RGB),
    "8UC1": Encoding(1, 1, cv2.COLOR_GRAY2RGB),
    "8UC3": Encoding(1, 3, cv2.COLOR_BGR2RGB),
    "8UC4": Encoding(1, 4, cv2.COLOR_BGRA2RGB),
    "rgb16": Encoding(2, 3, None),
    "bgr16": Encoding(2, 3, cv2.COLOR_BGR2RGB),
    "mono16": Encoding(2, 1, cv2.COLOR_GRAY2RGB),
    "bayer_rggb8": Encoding(1, 1, cv2.COLOR_BayerRGGB2RGB),
    "bayer_bggr8": Encoding(1, 1, cv2.COLOR_BayerBGGR2RGB),
    "bayer_gbrg8": Encoding(1, 1, cv2.COLOR_BayerGBRG2RGB),
    "bayer_grbg8": Encoding(1, 1, cv2.COLOR_BayerGRBG2RGB),
    "bayer_rggb16": Encoding(2, 1, cv2.COLOR_BayerRGGB2RGB),
    "bayer_bggr16": Encoding(2, 1, cv2.COLOR_BayerBGGR2RGB),
    "bayer_gbrg16": Encoding(2, 1, cv2.COLOR_BayerGBRG2RGB),
    "bayer_grbg16": Encoding(2, 1, cv2.COLOR_BayerGRBG2RGB),
    "yuv422": Encoding(1, 2, cv2.COLOR_YUV2RGB_UYVY),
    "uyvy": Encoding(1, 2, cv2.COLOR_YUV2RGB_UYVY),
    "yuv422_yuy2": Encoding(1, 2, cv2.COLOR_YUV2RGB_YUYV),
    "yuyv": Encoding(1, 2, cv2.COLOR_YUV2RGB_YUYV),
}
# REP 118: depth images are 16UC1 (mm) or 32FC1 (m). The word decides, not the bytes: mono16 has the
# same bytes as 16UC1, and ROS defines it as brightness.
_MEASURES: Final = ("16UC1", "16SC1", "32SC1", "32FC1", "64FC1")


def refuse_measures(word: str, where: str) -> None:
    """Refuse an encoding that holds a measure, such as depth, and no brightness.

    Raises:
        RecordingError: The word is one of 16UC1, 16SC1, 32SC1, 32FC1 and 64FC1.
    """
    if word in _MEASURES:
        raise depth_refusal(where, f"encoding {word!r}")


def depth_refusal(where: str, what: str) -> RecordingError:
    """The error that refuses a depth image."""
    return RecordingError(
        f"{where}: {what} holds a measure per pixel (depth), not brightness, and is no picture. "
        f"Name the colour topic of this camera as `image` in the robot manifest; a grey picture of "
        f"16 bits is published as mono16."
    )


def to_rgb(pixels: Any, word: str, where: str) -> NDArray[np.uint8]:
    """Convert pixels of an encoding, (H, W) or (H, W, C), to RGB, uint8 (H, W, 3).

    Raises:
        RecordingError: The size does not fit the encoding.
    """
    conversion = ENCODINGS[word].conversion
    try:
        rgb = pixels if conversion is None else cv2.cvtColor(pixels, conversion)
    except cv2.error as error:
        size = f"{pixels.shape[1]}x{pixels.shape[0]}"
        raise RecordingError(
            f"{where}: a {size} picture of encoding {word!r} cannot be converted: "
            f"{error.err}. Check the size and the encoding that the driver publishes."
        ) from error
    return eight_bits(rgb)


def eight_bits(pixels: Any) -> NDArray[np.uint8]:
    """Sixteen bits to eight by rounding v / 257; eight bits as they are."""
    if pixels.dtype == np.uint16:
        pixels = cv2.convertScaleAbs(pixels, alpha=1.0 / 257.0)
    return cast("NDArray[np.uint8]", pixels)


MAXIMUM_SIDE = 16_384
MAXIMUM_PIXELS = 1 << 26


def check_size(width: int, height: int, where: str) -> None:
    """Refuse a picture that is empty or too large.

    Raises:
        RecordingError: A side is outside 1..16384 pixels, or there are more than 2^26 pixels.
    """
    sides_fit = 1 <= width <= MAXIMUM_SIDE and 1 <= height <= MAXIMUM_SIDE
    if not sides_fit or width * height > MAXIMUM_PIXELS:
        raise RecordingError(
            f"{where}: a picture of {width}x{height} pixels; expected sides of 1 to {MAXIMUM_SIDE} "
            f"and at most {MAXIMUM_PIXELS} pixels. The message is damaged, or no camera's."
        )
