"""Odometry that a recording gives as tf alone: the base frame's poses along the path of edges."""

from __future__ import annotations

import numpy as np

from graspe_data.arrays import Stamps
from graspe_data.errors import GeometryError, RecordingError
from graspe_data.geometry import quaternion_from_rotation
from graspe_data.robot import Robot
from graspe_data.synchronisation.edges import Edges
from graspe_data.synchronisation.tracks import EdgeTrack, MotionTrack
from graspe_data.synchronisation.transform_buffer import (
    Edge,
    FixedEdge,
    MovingEdge,
    TransformBuffer,
)


def moving_edge_of(edges: Edges, robot: Robot) -> EdgeTrack:
    """The moving edge that tells the odometry, of several on the path the one of most samples.

    Raises:
        RecordingError: There is no path, or nothing on it moves.
    """
    topic, base = robot.topics.odometry, robot.base_frame
    try:
        path = TransformBuffer(_fixed(edges), _moving(edges)).along(robot.odometry_frame, base)
    except GeometryError as error:
        raise RecordingError(f"{topic}: no odometry in it: {error}") from error
    moving = [edges.moving[edge] for edge in path if edge in edges.moving]
    if not moving:
        raise RecordingError(
            f"{topic}: {robot.odometry_frame!r} -> {base!r} never moves, and a fixed edge is no "
            f"odometry. Name the frames that move against each other as `odometry_frame` and "
            f"`base_frame`, or another topic as `topics.odometry`."
        )
    return max(moving, key=lambda track: track.stamps.bag_ns.size)


def odometry_from_tf(edges: Edges, robot: Robot) -> MotionTrack:
    """The poses of the base frame in the odometry frame at the stamps of the moving edge.

    Poses at which another edge of the path is not known are NaN. There is no twist.

    Raises:
        RecordingError: As for ``moving_edge_of``.
    """
    track = moving_edge_of(edges, robot)
    buffer = TransformBuffer(_fixed(edges), _moving(edges))
    own: Edge = (track.parent, track.child)
    path = buffer.path(robot.odometry_frame, robot.base_frame)
    count = track.stamps.bag_ns.size
    if len(path) == 2 and own == (path[0], path[1]):  # noqa: PLR2004 - one hop, as published
        position, quaternion = track.translation, track.quaternion
    else:
        poses = buffer.poses(robot.odometry_frame, robot.base_frame, _header(track))
        position = np.where(poses.known[:, None], poses.translation, np.nan)
        quaternion = quaternion_from_rotation(poses.rotation)
    twist = np.full((count, 6), np.nan)
    frames = robot.odometry_frame, robot.base_frame
    return MotionTrack(track.stamps, position, quaternion, twist, *frames)


def _fixed(edges: Edges) -> dict[Edge, FixedEdge]:
    return edges.fixed_edges(_header)


def _moving(edges: Edges) -> dict[Edge, MovingEdge]:
    return {edge: moving_edge(track, _header(track)) for edge, track in edges.moving.items()}


def moving_edge(track: EdgeTrack, stamps_ns: Stamps) -> MovingEdge:
    """A moving edge on a time axis; of samples with one time the first counts."""
    stamps, first = np.unique(stamps_ns, return_index=True)
    segment = np.zeros(stamps.size, np.int64)
    return MovingEdge(stamps, track.translation[first], track.quaternion[first], segment)


def _header(track: EdgeTrack) -> Stamps:
    """The samples' own stamps; those of fixed edges from when they came."""
    own = track.stamps.header_ns
    return track.stamps.bag_ns if own is None or not own.any() else own
