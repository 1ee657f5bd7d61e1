"""The decoder of a lidar topic, whatever its message type."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Final

from graspe_data.errors import RecordingError
from graspe_data.recordings.decoding.lidars.hesai import HESAI_TYPES, HesaiDecoder
from graspe_data.recordings.decoding.lidars.livox import LIVOX_TYPES, decode_livox
from graspe_data.recordings.decoding.point_clouds import decode_points
from graspe_data.recordings.decoding.velodyne import VELODYNE_SCAN, VelodyneDecoder
from graspe_data.robot import Lidar
from graspe_data.sensor_data import PointCloud

POINT_CLOUD: Final = "sensor_msgs/msg/PointCloud2"
# Packets that are known and not read: nothing is at hand to hold a decoder of them against.
UNREAD_PACKETS: Final = {
    "robosense_msgs/msg/RobosenseScan": "RoboSense",
    "rslidar_msgs/msg/rslidarScan": "RoboSense",
    "rslidar_msg/msg/RslidarPacket": "RoboSense",
    "hesai_ros_driver/msg/UdpFrame": "Hesai's own driver",
}
WHOLE_SCANS: Final = (POINT_CLOUD, VELODYNE_SCAN, *HESAI_TYPES, *LIVOX_TYPES)


def cloud_decoder(
    message_type: str, topic: str, lidar: Lidar | str
) -> Callable[[object], PointCloud]:
    """Choose the decoder of a topic whose messages hold a whole cloud each.

    Packets that come one a message are joined by `CloudSource`, which serves all topics.

    Args:
        message_type: One of ``WHOLE_SCANS``.
        topic: Named in errors.
        lidar: Its model and angle table, for packets; or the model alone.

    Raises:
        RecordingError: No cloud in such messages.
    """
    model = lidar if isinstance(lidar, str) else lidar.model
    angles = None if isinstance(lidar, str) or lidar.angles is None else Path(lidar.angles)
    if message_type == VELODYNE_SCAN:
        velodyne = VelodyneDecoder(model)
        return lambda message: velodyne.decode(message, topic)
    if message_type in HESAI_TYPES:
        hesai = HesaiDecoder(model, angles)
        return lambda message: hesai.decode(message, topic)
    if message_type in LIVOX_TYPES:
        return lambda message: decode_livox(message, topic)
    if message_type == POINT_CLOUD:
        strength = None if isinstance(lidar, str) else lidar.intensity_field
        return lambda message: decode_points(message, topic, strength)
    if message_type in UNREAD_PACKETS:
        raise RecordingError(
            f"{topic}: {message_type}: packets of {UNREAD_PACKETS[message_type]} are not read. "
            f"Record the driver's PointCloud2 too, or replay the packets through the driver."
        )
    raise RecordingError(
        f"{topic}: {message_type} holds no cloud; expected {', '.join(WHOLE_SCANS)}. "
        f"Name another topic as `points` in the robot manifest."
    )
