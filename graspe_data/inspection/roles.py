"""What a topic could serve as, by its type and name."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from itertools import takewhile
from typing import Final, Literal

Role = Literal[
    "image", "points", "odometry", "command", "imu", "camera_info", "scan", "tf", "tf_static"
]

_ROLES: Final[Mapping[str, tuple[Role, ...]]] = {
    "sensor_msgs/msg/Image": ("image",),
    "sensor_msgs/msg/CompressedImage": ("image",),
    "foxglove_msgs/msg/CompressedVideo": ("image",),
    "ffmpeg_image_transport_msgs/msg/FFMPEGPacket": ("image",),
    "sensor_msgs/msg/PointCloud2": ("points",),
    "velodyne_msgs/msg/VelodyneScan": ("points",),
    "pandar_msgs/msg/PandarScan": ("points",),
    "nebula_msgs/msg/NebulaPackets": ("points",),
    "livox_ros_driver/msg/CustomMsg": ("points",),
    "livox_ros_driver2/msg/CustomMsg": ("points",),
    "ouster_ros/msg/PacketMsg": ("points",),
    "ouster_msgs/msg/PacketMsg": ("points",),
    "ouster_sensor_msgs/msg/PacketMsg": ("points",),
    "nav_msgs/msg/Odometry": ("odometry",),
    "geometry_msgs/msg/PoseWithCovarianceStamped": ("odometry",),
    "geometry_msgs/msg/PoseStamped": ("odometry",),
    "geometry_msgs/msg/TwistWithCovarianceStamped": ("odometry",),
    "geometry_msgs/msg/TwistStamped": ("odometry", "command"),
    "geometry_msgs/msg/Twist": ("command",),
    "sensor_msgs/msg/Imu": ("imu",),
    "sensor_msgs/msg/CameraInfo": ("camera_info",),
    "sensor_msgs/msg/LaserScan": ("scan",),
    "tf2_msgs/msg/TFMessage": ("tf",),
    "tf/msg/tfMessage": ("tf",),
}
_PREFERENCE: Final = list(_ROLES)
# Parts of names that tell of something else than the robot's own forward sensor.
_SECONDARY: Final[Mapping[Role, tuple[str, ...]]] = {
    "image": ("depth", "infra", "mask", "debug", "segment", "right", "rear", "back"),
    "points": ("map", "ground", "obstacle", "filtered", "cluster", "depth", "rear"),
    "odometry": ("goal", "target", "gps", "command", "cmd", "ground_truth"),
    "command": ("raw", "teleop", "joy"),
    "camera_info": ("depth", "infra"),
}


def roles_of(topic: str, message_type: str) -> tuple[Role, ...]:
    """What a topic could serve as; empty where it serves nothing here."""
    roles = _ROLES.get(message_type, ())
    if message_type.endswith("/PacketMsg") and "imu" in topic:
        return ()
    if roles == ("tf",) and topic.endswith("static"):
        return ("tf_static",)
    if "command" in roles and "odometry" in roles and "cmd" in topic:
        return ("command",)
    return roles


def likeliest(
    role: Role, candidates: Mapping[str, tuple[str, int]], beside: str | None = None
) -> str | None:
    """Guess which topic serves a role.

    Prefers names that tell of nothing else, then, if ``beside`` is given, a name that begins like
    that one, then the more telling type, then more messages, then the alphabet.

    Args:
        role: The role to fill.
        candidates: Message type and number of messages of each topic that could.
        beside: A topic of the same sensor, as the image is to its camera_info.
    """

    def rank(name: str) -> tuple[int, int, int, int, str]:
        kind, count = candidates[name]
        secondary = sum(part in name.lower() for part in _SECONDARY.get(role, ()))
        shared = _shared(name, beside) if beside else 0
        return secondary, -shared, _type_rank(role, kind), -count, name

    filled: Collection[str] = [name for name, (_, count) in candidates.items() if count]
    return min(filled, key=rank, default=None)


def _shared(name: str, other: str) -> int:
    """How many parts of two names are the same, from the first on."""
    pairs = zip(name.split("/"), other.split("/"), strict=False)
    return sum(1 for _ in takewhile(lambda pair: pair[0] == pair[1], pairs))


def _type_rank(role: Role, message_type: str) -> int:
    return _PREFERENCE.index(message_type) if role == "odometry" else 0
