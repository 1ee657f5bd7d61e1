"""The decoder of a lidar topic, whatever its message type."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from graspe_data.errors import RecordingError
from graspe_data.recordings.decoding.point_clouds import decode_points
from graspe_data.recordings.decoding.velodyne import VELODYNE_SCAN, VelodyneDecoder
from graspe_data.sensor_data import PointCloud

POINT_CLOUD: Final = "sensor_msgs/msg/PointCloud2"


def cloud_decoder(message_type: str, topic: str, model: str) -> Callable[[object], PointCloud]:
    """Choose the decoder of a topic.

    Args:
        message_type: ``sensor_msgs/msg/PointCloud2`` or ``velodyne_msgs/msg/VelodyneScan``.
        topic: Named in errors.
        model: The lidar's model, for packets.

    Raises:
        RecordingError: No cloud in such messages.
    """
    if message_type == VELODYNE_SCAN:
        velodyne = VelodyneDecoder(model)
        return lambda message: velodyne.decode(message, topic)
    if message_type == POINT_CLOUD:
        return lambda message: decode_points(message, topic)
    raise RecordingError(
        f"{topic}: {message_type} holds no cloud; expected {POINT_CLOUD} or {VELODYNE_SCAN}. "
        f"Name another topic as `points` in the robot manifest."
    )
