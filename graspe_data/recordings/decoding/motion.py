"""Odometry, twists, poses, inertial samples and transforms as what they say of motion."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final

from graspe_data.errors import RecordingError
from graspe_data.recordings.decoding.header import place, refuses_unfit_messages, stamp_ns
from graspe_data.sensor_data import InertialSample, Motion, StampedTransform

Triple = tuple[float, float, float]
Quadruple = tuple[float, float, float, float]


@refuses_unfit_messages
def decode_motion(message: Any, message_type: str, topic: str) -> Motion:
    """Decode one message that tells how the robot moves.

    Odometry gives pose and twist; TwistStamped and Twist a twist, the latter without stamp and
    frame; PoseStamped a pose, whose child frame is unnamed. The variants with covariance do alike.

    Raises:
        RecordingError: Another message type; names those that are known.
    """
    decoder = _DECODERS.get(message_type)
    if decoder is None:
        raise RecordingError(
            f"{topic}: {message_type} tells no motion; expected one of {', '.join(_DECODERS)}, or "
            f"tf. Name another topic as `odometry` or `command` in the robot manifest."
        )
    return decoder(message)


def vector(message: Any) -> Triple:
    """A geometry_msgs Vector3 or Point as x, y, z."""
    return float(message.x), float(message.y), float(message.z)


def quaternion(message: Any) -> Quadruple:
    """A geometry_msgs Quaternion as x, y, z, w."""
    return float(message.x), float(message.y), float(message.z), float(message.w)


def _odometry(message: Any) -> Motion:
    twist, pose = message.twist.twist, message.pose.pose
    return Motion(
        stamp_ns=stamp_ns(message.header),
        frame=message.header.frame_id,
        child_frame=message.child_frame_id,
        position=vector(pose.position),
        quaternion=quaternion(pose.orientation),
        linear_velocity=float(twist.linear.x),
        yaw_rate=float(twist.angular.z),
        twist=(*vector(twist.linear), *vector(twist.angular)),
    )


def _twist(twist: Any, header: Any | None = None) -> Motion:
    frame = "" if header is None else header.frame_id
    return Motion(
        stamp_ns=None if header is None else stamp_ns(header),
        frame=frame,
        child_frame=frame,
        position=None,
        quaternion=None,
        linear_velocity=float(twist.linear.x),
        yaw_rate=float(twist.angular.z),
        twist=(*vector(twist.linear), *vector(twist.angular)),
    )


def _pose(pose: Any, header: Any) -> Motion:
    return Motion(
        stamp_ns=stamp_ns(header),
        frame=header.frame_id,
        child_frame="",
        position=vector(pose.position),
        quaternion=quaternion(pose.orientation),
        linear_velocity=None,
        yaw_rate=None,
    )


_DECODERS: Final[dict[str, Callable[[Any], Motion]]] = {
    "nav_msgs/msg/Odometry": _odometry,
    "geometry_msgs/msg/TwistStamped": lambda m: _twist(m.twist, m.header),
    "geometry_msgs/msg/TwistWithCovarianceStamped": lambda m: _twist(m.twist.twist, m.header),
    "geometry_msgs/msg/Twist": _twist,
    "geometry_msgs/msg/PoseStamped": lambda m: _pose(m.pose, m.header),
    "geometry_msgs/msg/PoseWithCovarianceStamped": lambda m: _pose(m.pose.pose, m.header),
}


_NOT_MEASURED: Triple = (float("nan"),) * 3


@refuses_unfit_messages
def decode_inertial(message: Any, topic: str) -> InertialSample:
    """Decode a sensor_msgs/Imu.

    A quantity that the message marks as not measured, by a covariance that begins with -1, is NaN.

    Raises:
        RecordingError: The message marks both quantities as not measured.
    """
    gyro_known = float(message.angular_velocity_covariance[0]) != -1.0
    acceleration_known = float(message.linear_acceleration_covariance[0]) != -1.0
    if not (gyro_known or acceleration_known):
        raise RecordingError(
            f"{place(topic, message.header)}: neither angular velocity nor acceleration is "
            f"measured (both covariances begin with -1). Name another topic as `imu`."
        )
    return InertialSample(
        stamp_ns=stamp_ns(message.header),
        frame=message.header.frame_id,
        angular_velocity=vector(message.angular_velocity) if gyro_known else _NOT_MEASURED,
        linear_acceleration=(
            vector(message.linear_acceleration) if acceleration_known else _NOT_MEASURED
        ),
    )


@refuses_unfit_messages
def decode_transforms(message: Any) -> list[StampedTransform]:
    """Decode a tf2_msgs/TFMessage or a tf/tfMessage; frame names stay as published."""
    return [
        StampedTransform(
            stamp_ns=stamp_ns(edge.header),
            parent=edge.header.frame_id,
            child=edge.child_frame_id,
            translation=vector(edge.transform.translation),
            quaternion=quaternion(edge.transform.rotation),
        )
        for edge in message.transforms
    ]
