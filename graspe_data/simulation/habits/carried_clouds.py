"""Clouds that a driver has carried into the odometry frame, by the pose at their stamp."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from graspe_data.errors import ManifestError
from graspe_data.geometry import Transform, plain_frame
from graspe_data.simulation.habits.clouds import laid_out, points_of
from graspe_data.simulation.habits.message_parts import edges_of, pose_of, stamp_of
from graspe_data.simulation.habits.recorded import Habit, Recorded
from graspe_data.simulation.habits.transforms import TF_STATIC
from graspe_data.synchronisation.transform_buffer import TransformBuffer


def clouds_in_odometry_frame(points: str, odometry: str) -> Habit:
    """Points in the frame of the odometry's header.

    Spot publishes its Velodyne's points relative to the odometry frame
    (bdaiinstitute/spot_ros2, issue 542). Carried in float64 and stored in float32, a point 100 m
    from the origin is kept to 8 um. A cloud waits for the odometry of its stamp; between two poses
    the nearer one would be wrong, so each cloud needs a pose at its very stamp.

    Raises:
        ManifestError: A cloud has no odometry at its stamp.
    """

    def habit(stream: Iterable[Recorded]) -> Iterator[Recorded]:
        carrier, waiting = _Carrier(points), deque[Recorded]()
        for message in stream:
            carrier.learn(message, odometry)
            waiting.append(message)
            while waiting and carrier.is_ready(waiting[0]):
                yield carrier.carry(waiting.popleft())
        yield from (carrier.carry(message) for message in waiting)

    return habit


class _Carrier:
    """Knows the mountings and the latest poses."""

    def __init__(self, topic: str) -> None:
        self._topic = topic
        self._edges: dict[tuple[str, str], Transform] = {}
        self._poses: dict[int, tuple[str, str, Transform]] = {}
        self._latest = -1

    def learn(self, message: Recorded, odometry: str) -> None:
        content = message.content
        if message.topic == TF_STATIC:
            self._edges |= {(e.parent, e.child): e.transform for e in edges_of(content)}
        elif message.topic == odometry:
            self._latest = stamp_of(content)
            frames = content.header.frame_id, content.child_frame_id
            self._poses[self._latest] = (*frames, pose_of(content))

    def is_ready(self, message: Recorded) -> bool:
        return message.topic != self._topic or stamp_of(message.content) <= self._latest

    def carry(self, message: Recorded) -> Recorded:
        if message.topic != self._topic:
            return message
        stamp_ns = stamp_of(message.content)
        if stamp_ns not in self._poses:
            raise ManifestError(
                f"{self._topic}: the cloud at {stamp_ns} ns has no odometry at its stamp; "
                f"let the scenario's rates.odometry be a multiple of lidar.rate"
            )
        self._poses = {stamp: pose for stamp, pose in self._poses.items() if stamp >= stamp_ns}
        return replace(message, content=self._moved(message.content, *self._poses[stamp_ns]))

    def _moved(self, cloud: Any, odom: str, base: str, pose: Transform) -> Any:
        frame = plain_frame(cloud.header.frame_id)
        mounted = TransformBuffer.of_fixed(self._edges).lookup(base, frame, 0)
        points = points_of(cloud).copy()
        xyz = np.stack([points[axis] for axis in "xyz"], axis=1).astype(np.float64)
        moved = (pose @ mounted).apply(xyz)
        for axis, values in zip("xyz", moved.T, strict=True):
            points[axis] = values
        return replace(laid_out(cloud, points), header=replace(cloud.header, frame_id=odom))
