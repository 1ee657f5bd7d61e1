"""Image and CompressedImage messages as RGB pictures."""

from __future__ import annotations

from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from graspe_data.errors import RecordingError
from graspe_data.recordings.decoding.compressed_pictures import decode_compressed
from graspe_data.recordings.decoding.header import place, refuses_unfit_messages, stamp_ns
from graspe_data.recordings.decoding.picture_encodings import (
    ENCODINGS,
    Encoding,
    check_size,
    refuse_measures,
    to_rgb,
)
from graspe_data.sensor_data import Picture

IMAGE: Final = "sensor_msgs/msg/Image"
COMPRESSED_IMAGE: Final = "sensor_msgs/msg/CompressedImage"


@refuses_unfit_messages
def decode_image(message: Any, message_type: str, topic: str) -> Picture:
    """Decode a sensor_msgs Image or CompressedImage.

    8UC3 and 8UC4 are taken as BGR and BGRA, OpenCV's order, as cv_bridge takes them. Sixteen bits
    become eight by rounding v / 257. Alpha is dropped. YUV is BT.601 of limited range. An EXIF
    orientation is not applied: the calibration is that of the sensor's rows and columns. A mosaic
    in a JPEG or PNG, as compressed_image_transport writes of a Bayer topic, is demosaiced.

    Args:
        message: The message, with ROS's attributes.
        message_type: ``sensor_msgs/msg/Image`` or ``sensor_msgs/msg/CompressedImage``.
        topic: Named in errors.

    Raises:
        RecordingError: An encoding or file format that is not supported, a depth image, a picture
            too large, or fewer bytes than the size asks for.
    """
    where = place(topic, message.header)
    if message_type == COMPRESSED_IMAGE:
        rgb = decode_compressed(message.data, message.format, where)
    elif message_type == IMAGE:
        rgb = _raw_picture(message, where)
    else:
        raise RecordingError(
            f"{where}: {message_type} is no picture; expected {IMAGE} or {COMPRESSED_IMAGE}. "
            f"Name another topic as `image` in the robot manifest."
        )
    return Picture(stamp_ns(message.header), message.header.frame_id, rgb)


def _raw_picture(message: Any, where: str) -> NDArray[np.uint8]:
    refuse_measures(message.encoding, where)
    encoding = ENCODINGS.get(message.encoding)
    if encoding is None:
        raise RecordingError(
            f"{where}: encoding {message.encoding!r} is not supported; expected one of "
            f"{', '.join(ENCODINGS)}. Convert the topic, or name another as `image`."
        )
    return to_rgb(_pixels(message, encoding, where), message.encoding, where)


def _pixels(message: Any, encoding: Encoding, where: str) -> NDArray[np.uint8 | np.uint16]:
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
