"""Livox CustomMsg, of both generations of the driver, as point clouds."""

from __future__ import annotations

from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from graspe_data.errors import RecordingError
from graspe_data.recordings.decoding.header import place, refuses_unfit_messages, stamp_ns
from graspe_data.sensor_data import PointCloud

LIVOX_TYPES: Final = ("livox_ros_driver/msg/CustomMsg", "livox_ros_driver2/msg/CustomMsg")

# Livox user manuals (Mid-70, HAP, Mid-360): of a tag, bits 0-1 judge a point by its place and bits
# 2-3 by its intensity; 0 is normal, 1 the surest noise, and what follows is less sure. Bits 4-5
# number the return (or judge by other means), bits 6-7 are reserved.
_BY_PLACE, _BY_INTENSITY = 0b0011, 0b1100
_SURE_NOISE: Final = (0b0001, 0b0100)

_POINT: Final = np.dtype([("xyz", "<f4", 3), ("reflectivity", "u1"), ("tag", "u1"), ("line", "u1")])


@refuses_unfit_messages
def decode_livox(message: Any, topic: str) -> PointCloud:
    """Decode a livox_ros_driver or livox_ros_driver2 CustomMsg.

    ``ring`` is the laser's ``line``, ``intensity`` the ``reflectivity``, 0..255. Points at the
    origin and points that are not finite are no returns. Of the tag, see `sure_noise`.

    Raises:
        RecordingError: ``point_num`` is not the number of points.
    """
    where = place(topic, message.header)
    if len(message.points) != int(message.point_num):
        raise RecordingError(
            f"{where}: point_num is {message.point_num}, but there are {len(message.points)} "
            f"points. The message is damaged."
        )
    rows = [((p.x, p.y, p.z), p.reflectivity, p.tag, p.line) for p in message.points]
    points = np.array(rows, _POINT)
    xyz = points["xyz"].reshape(-1, 3)
    kept = np.isfinite(xyz).all(axis=1) & xyz.any(axis=1) & ~sure_noise(points["tag"])
    return PointCloud(
        stamp_ns=stamp_ns(message.header),
        frame=message.header.frame_id,
        xyz=xyz[kept].astype(np.float32),
        intensity=points["reflectivity"][kept].astype(np.float32),
        ring=points["line"][kept].astype(np.int32),
    )


def sure_noise(tag: NDArray[np.uint8]) -> NDArray[np.bool_]:
    """Whether the sensor holds a point for noise with the highest confidence.

    Such points are dropped: raindrops, fog and dust by their intensity, and points drawn out
    between a near and a far object by their place. Points of moderate and low confidence are kept,
    as are second returns: reliability is to be judged from what the sensor saw, not hidden.
    """
    by_place, by_intensity = tag & _BY_PLACE, tag & _BY_INTENSITY
    return np.asarray((by_place == _SURE_NOISE[0]) | (by_intensity == _SURE_NOISE[1]), np.bool_)
