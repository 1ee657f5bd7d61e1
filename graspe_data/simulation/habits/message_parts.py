"""Poses, twists and edges out of messages, and back into them; float64 throughout."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from graspe_data.arrays import Floats
from graspe_data.geometry import Transform
from graspe_data.recordings.message_types import message_classes
from graspe_data.simulation.quaternion import quaternion_from_rotation

SECOND = 1_000_000_000


@dataclass(frozen=True)
class Edge:
    """One edge of tf: the child's pose in the parent."""

    parent: str
    child: str
    transform: Transform

    def inverse(self) -> Edge:
        """The same edge told from the child."""
        return Edge(self.child, self.parent, self.transform.inverse())


def message_class(name: str) -> Any:
    """The class of a message, ``package/Name``."""
    package, kind = name.split("/")
    return message_classes()[f"{package}/msg/{kind}"]


def stamp_of(message: Any) -> int:
    """The stamp of a message with a header, ns."""
    stamp = message.header.stamp
    return int(stamp.sec) * SECOND + int(stamp.nanosec)


def header(stamp_ns: int, frame: str) -> Any:
    """A header."""
    seconds, nanoseconds = divmod(stamp_ns, SECOND)
    stamp = message_class("builtin_interfaces/Time")(sec=seconds, nanosec=nanoseconds)
    return message_class("std_msgs/Header")(stamp=stamp, frame_id=frame)


def vector(value: Any) -> Floats:
    """A Vector3 or Point as (3,)."""
    return np.array([value.x, value.y, value.z], np.float64)


def with_vector(value: Any, new: Floats) -> Any:
    """A Vector3 or Point with other numbers."""
    x, y, z = (float(axis) for axis in new)
    return replace(value, x=x, y=y, z=z)


def with_rotation(value: Any, rotation: Floats) -> Any:
    """A Quaternion of another rotation (3, 3)."""
    x, y, z, w = (float(part) for part in quaternion_from_rotation(rotation))
    return replace(value, x=x, y=y, z=z, w=w)


def transform_of(translation: Any, rotation: Any) -> Transform:
    """The transform of a Vector3 or Point and a Quaternion."""
    quaternion = np.array([rotation.x, rotation.y, rotation.z, rotation.w], np.float64)
    return Transform.from_quaternion(vector(translation), quaternion)


def pose_of(odometry: Any) -> Transform:
    """The pose of an Odometry message."""
    pose = odometry.pose.pose
    return transform_of(pose.position, pose.orientation)


def edges_of(message: Any) -> list[Edge]:
    """The edges of a TFMessage."""
    return [
        Edge(
            stamped.header.frame_id,
            stamped.child_frame_id,
            transform_of(stamped.transform.translation, stamped.transform.rotation),
        )
        for stamped in message.transforms
    ]


def tf_message(stamp_ns: int, edges: Sequence[Edge]) -> Any:
    """A TFMessage of edges that share a stamp."""
    empty = message_class("geometry_msgs/Vector3")(x=0.0, y=0.0, z=0.0)
    upright = message_class("geometry_msgs/Quaternion")(x=0.0, y=0.0, z=0.0, w=1.0)
    stamped = [
        message_class("geometry_msgs/TransformStamped")(
            header=header(stamp_ns, edge.parent),
            child_frame_id=edge.child,
            transform=message_class("geometry_msgs/Transform")(
                translation=with_vector(empty, edge.transform.translation),
                rotation=with_rotation(upright, edge.transform.rotation),
            ),
        )
        for edge in edges
    ]
    return message_class("tf2_msgs/TFMessage")(transforms=stamped)
