"""LaserScan messages as planar scans."""

from __future__ import annotations

from math import isfinite
from typing import Any

import numpy as np

from graspe_data.errors import RecordingError
from graspe_data.recordings.decoding.header import place, stamp_ns
from graspe_data.recordings.decoding.unfit_messages import refuses_unfit_messages
from graspe_data.sensor_data import PlanarScan


@refuses_unfit_messages
def decode_scan(message: Any, topic: str) -> PlanarScan:
    """Decode a sensor_msgs/LaserScan; ranges stay as published, NaN and infinite ones included.

    Raises:
        RecordingError: The angles are not finite, or several rays have one angle.
    """
    start, increment = float(message.angle_min), float(message.angle_increment)
    if not (isfinite(start) and isfinite(increment)) or (
        increment == 0.0 and len(message.ranges) > 1
    ):
        raise RecordingError(
            f"{place(topic, message.header)}: {len(message.ranges)} rays from angle {start} rad in "
            f"steps of {increment} rad; expected finite angles and a step. The driver is wrong."
        )
    return PlanarScan(
        stamp_ns=stamp_ns(message.header),
        frame=message.header.frame_id,
        angle_minimum=start,
        angle_increment=increment,
        ranges=np.array(message.ranges, np.float32),
    )
