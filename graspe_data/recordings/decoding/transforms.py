"""Tf messages as edges between frames."""

from __future__ import annotations

from typing import Any

from graspe_data.recordings.decoding.header import stamp_ns
from graspe_data.recordings.decoding.motion import quaternion, vector
from graspe_data.recordings.decoding.unfit_messages import refuses_unfit_messages
from graspe_data.sensor_data import StampedTransform


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
