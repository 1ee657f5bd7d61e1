"""Image and CompressedImage messages as RGB pictures."""

from __future__ import annotations

from typing import Any, Final, NamedTuple, cast

import cv2
import numpy as np
from numpy.typing import NDArray

from graspe_data.errors import RecordingError
from graspe_data.recordings.decoding.compressed_pictures import decode_compressed
from graspe_data.recordings.decoding.header import place, stamp_ns
from graspe_data.recordings.decoding.picture_limits import check_size
from graspe_data.recordings.decoding.unfit_messages import refuses_unfit_messages
from graspe_data.sensor_data import Picture

IMAGE: Final = "sensor_msgs/msg/Image"
COMPRESSED_IMAGE: Final = "sensor_msgs/msg/CompressedImage"


class _Encoding(NamedTuple):
    """Bytes and channels of a pixel, and OpenCV's conversion to RGB; None copies."""

    depth: int
    channels: int
    conversion: int | None


_ENCODINGS: Final = {
    "rgb8": _Encoding(1, 3, None),
    "bgr8": _Encoding(1, 3, cv2.COLOR_BGR2RGB),
    "rgba8": _Encoding(1, 4, cv2.COLOR_RGBA2RGB),
    "bgra8": _Encoding(1, 4, cv2.COLOR_BGRA2RGB),
    "mono8": _Encoding(1, 1, cv2.COLOR_GRAY2RGB),
    "8UC1": _Encoding(1, 1, cv2.COLOR_GRAY2RGB),
    "8UC3": _Encoding(1, 3, cv2.COLOR_BGR2RGB),
    "8UC4": _Encoding(1, 4, cv2.COLOR_BGRA2RGB),
    "rgb16": _Encoding(2, 3, None),
    "bgr16": _Encoding(2, 3, cv2.COLOR_BGR2RGB),
    "mono16": _Encoding(2, 1, cv2.COLOR_GRAY2RGB),
    "bayer_rggb8": _Encoding(1, 1, cv2.COLOR_BayerRGGB2RGB),
    "bayer_bggr8": _Encoding(1, 1, cv2.COLOR_BayerBGGR2RGB),
    "bayer_gbrg8": _Encoding(1, 1, cv2.COLOR_BayerGBRG2RGB),
    "bayer_grbg8": _Encoding(1, 1, cv2.COLOR_BayerGRBG2RGB),
    "bayer_rggb16": _Encoding(2, 1, cv2.COLOR_BayerRGGB2RGB),
    "bayer_bggr16": _Encoding(2, 1, cv2.COLOR_BayerBGGR2RGB),
    "bayer_gbrg16": _Encoding(2, 1, cv2.COLOR_BayerGBRG2RGB),
    "bayer_grbg16": _Encoding(2, 1, cv2.COLOR_BayerGRBG2RGB),
    "yuv422": _Encoding(1, 2, cv2.COLOR_YUV2RGB_UYVY),
    "uyvy": _Encoding(1, 2, cv2.COLOR_YUV2RGB_UYVY),
    "yuv422_yuy2": _Encoding(1, 2, cv2.COLOR_YUV2RGB_YUYV),
    "yuyv": _Encoding(1, 2, cv2.COLOR_YUV2RGB_YUYV),
}


@refuses_unfit_messages
def decode_image(message: Any, message_type: str, topic: str) -> Picture:
    """Decode a sensor_msgs Image or CompressedImage.

    8UC3 and 8UC4 are taken as BGR and BGRA, OpenCV's order, as cv_bridge takes them. Sixteen bits
    become eight by rounding v / 257. Alpha is dropped. YUV is BT.601 of limited range. An EXIF
    orientation is not applied: the calibration is that of the sensor's rows and columns.

    Args:
        message: The message, with ROS's attributes.
        message_type: ``sensor_msgs/msg/Image`` or ``sensor_msgs/msg/CompressedImage``.
        topic: Named in errors.

    Raises:
        RecordingError: An encoding or file format that is not supported, a picture too large, or
            fewer bytes than the size asks for.
    """
    where = place(topic, message.header)
    if message_type == COMPRESSED_IMAGE:
        rgb = decode_compressed(message.data, where)
    elif message_type == IMAGE:
        rgb = _raw_picture(message, where)
    else:
        raise RecordingError(
            f"{where}: {message_type} is no picture; expected {IMAGE} or {COMPRESSED_IMAGE}. "
            f"Name another topic as `image` in the robot manifest."
        )
    return Picture(stamp_ns(message.header), message.header.frame_id, rgb)


def _raw_picture(message: Any, where: str) -> NDArray[np.uint8]:
    encoding = _ENCODINGS.get(message.encoding)
    if encoding is None:
        raise RecordingError(
            f"{where}: encoding {message.encoding!r} is not supported; expected one of "
            f"{', '.join(_ENCODINGS)}. Convert the topic, or name another as `image`."
        )
    pixels = _pixels(message, encoding, where)
    try:
        rgb = pixels if encoding.conversion is None else cv2.cvtColor(pixels, encoding.conversion)
    except cv2.error as error:
        size = f"{message.width}x{message.height}"
        raise RecordingError(
            f"{where}: a {size} picture of encoding {message.encoding!r} cannot be converted: "
            f"{error.err}. Check the size and the encoding that the driver publishes."
        ) from error
    return _eight_bits(rgb)


def _pixels(message: Any, encoding: _Encoding, where: str) -> NDArray[np.uint8 | np.uint16]:
    """The pixels in native byte order, (H, W) or (H, W, C), without the padding of the rows."""
    height, width, step = int(message.height), int(message.width), int(message.step)
    check_size(width, height, where)
    pixel = encoding.depth * encoding.channels
    needed = step * (height - 1) + width * pixel
    if step < width * pixel or len(message.data) < needed:
        raise RecordingError(
            f"{where}: a {width}x{height} picture of encoding {message.encoding!r} needs a step of "
            f"at least {width * pixel} bytes and, at its step of {step}, {max(needed, 0)} bytes of "
            f"data; found {len(message.data)}. The message is damaged or its driver is wrong."
        )
    dtype = np.dtype(f"{'>' if message.is_bigendian else '<'}u{encoding.depth}")
    view = np.ndarray(
        (height, width, encoding.channels),
        dtype,
        buffer=message.data,
        strides=(step, pixel, encoding.depth),
    )
    pixels = np.ascontiguousarray(view, dtype.newbyteorder("="))
    return pixels[..., 0] if encoding.channels == 1 else pixels


def _eight_bits(pixels: Any) -> NDArray[np.uint8]:
    if pixels.dtype == np.uint16:
        pixels = cv2.convertScaleAbs(pixels, alpha=1.0 / 257.0)
    return cast("NDArray[np.uint8]", pixels)
