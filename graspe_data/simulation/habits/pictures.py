"""Pictures as drivers send them: raw in an encoding, where the simulator sends JPEG."""

from __future__ import annotations

from typing import Any, Final, Literal

import cv2
import numpy as np

from graspe_data.recordings.decoding import decode_image
from graspe_data.recordings.decoding.images import COMPRESSED_IMAGE
from graspe_data.simulation.habits.message_parts import message_class
from graspe_data.simulation.habits.recorded import Habit, changed

Encoding = Literal["rgb8", "bgr8", "mono8"]
_CONVERSION: Final[dict[Encoding, int | None]] = {
    "rgb8": None,
    "bgr8": cv2.COLOR_RGB2BGR,
    "mono8": cv2.COLOR_RGB2GRAY,
}


def raw_pictures(topic: str, encoding: Encoding) -> Habit:
    """sensor_msgs/Image in place of CompressedImage."""

    def change(message: Any) -> Any:
        rgb = decode_image(message, COMPRESSED_IMAGE, topic).rgb
        conversion = _CONVERSION[encoding]
        pixels = rgb if conversion is None else cv2.cvtColor(rgb, conversion)
        height, width = pixels.shape[:2]
        return message_class("sensor_msgs/Image")(
            header=message.header,
            height=height,
            width=width,
            encoding=encoding,
            is_bigendian=0,
            step=pixels.nbytes // height,
            data=np.ascontiguousarray(pixels).astype(np.uint8).ravel(),
        )

    return changed(topic, change)
