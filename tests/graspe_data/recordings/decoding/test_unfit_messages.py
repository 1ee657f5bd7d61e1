from __future__ import annotations

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import pytest

from graspe_data.errors import RecordingError
from graspe_data.recordings.decoding import (
    VelodyneDecoder,
    decode_calibration,
    decode_image,
    decode_inertial,
    decode_motion,
    decode_points,
    decode_scan,
    decode_transforms,
)

DECODERS: dict[str, Callable[[Any], object]] = {
    "calibration": lambda message: decode_calibration(message, "/x"),
    "image": lambda message: decode_image(message, "sensor_msgs/msg/Image", "/x"),
    "inertial": lambda message: decode_inertial(message, "/x"),
    "motion": lambda message: decode_motion(message, "nav_msgs/msg/Odometry", "/x"),
    "packets": lambda message: VelodyneDecoder().decode(message, "/x"),
    "points": lambda message: decode_points(message, "/x"),
    "scan": lambda message: decode_scan(message, "/x"),
    "transforms": decode_transforms,
}
HEADER = SimpleNamespace(stamp=SimpleNamespace(sec=1, nanosec=0), frame_id="x")


@pytest.mark.parametrize("name", DECODERS)
@pytest.mark.parametrize(
    "message",
    [
        SimpleNamespace(),
        SimpleNamespace(header=HEADER),
        SimpleNamespace(header=7, transforms=3, twist=None),
    ],
)
def test_a_message_without_the_fields_of_its_type_is_refused(name: str, message: object) -> None:
    with pytest.raises(RecordingError, match=r"not those of the message type: .*definition"):
        DECODERS[name](message)
