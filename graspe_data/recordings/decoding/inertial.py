"""Imu messages as inertial samples."""

from __future__ import annotations

from typing import Any

from graspe_data.errors import RecordingError
from graspe_data.recordings.decoding.header import place, stamp_ns
from graspe_data.recordings.decoding.motion import Triple, vector
from graspe_data.recordings.decoding.unfit_messages import refuses_unfit_messages
from graspe_data.sensor_data import InertialSample

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
