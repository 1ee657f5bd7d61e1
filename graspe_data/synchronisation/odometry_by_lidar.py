"""Odometry made from a recording's clouds, where the robot's manifest asks for it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from graspe_data.arrays import Stamps
from graspe_data.calibration import declared_mounting
from graspe_data.errors import GeometryError, RecordingError
from graspe_data.geometry import Transform, plain_frame
from graspe_data.recordings.decoding.lidars.cloud_source import CloudSource
from graspe_data.recordings.messages import RawMessage
from graspe_data.recordings.recording import Recording
from graspe_data.robot import Robot
from graspe_data.synchronisation.edges import sort_edges
from graspe_data.synchronisation.findings import Finding
from graspe_data.synchronisation.fitted_velocities import fitted_velocities
from graspe_data.synchronisation.lidar_odometry import LidarOdometry
from graspe_data.synchronisation.tracks import MotionTrack, StampTrack, Tracks
from graspe_data.synchronisation.transform_buffer import TransformBuffer


def with_lidar_odometry(
    recording: Recording, tracks: Tracks, robot: Robot, findings: list[Finding]
) -> Tracks:
    """Register the clouds of a recording one after another and take the poses as its odometry.

    Where stamps go back, as at a restart, a new map begins.

    Raises:
        RecordingError: The lidar's mounting is not known, no two clouds fit each other, or KISS-ICP
            is not installed.
    """
    topic, mounting = robot.topics.points, _mounting(tracks, robot)
    source = CloudSource(recording, topic, robot.lidar)
    parts: list[LidarOdometry] = []
    ordinals: list[int] = []
    newest = None
    for ordinal, message in enumerate(source.gather(recording.messages([topic]))):
        if isinstance(message, RawMessage):
            continue
        try:
            cloud = message.decode()
        except RecordingError:
            continue
        if newest is None or cloud.stamp_ns < newest:
            parts.append(LidarOdometry(mounting, minimum_range=robot.lidar.minimum_range))
        newest = cloud.stamp_ns
        parts[-1].add(cloud)
        ordinals.append(ordinal)
    if not any(np.isfinite(part.result()[1]).all(axis=1).sum() > 1 for part in parts):
        raise RecordingError(
            f"{topic}: no two of {len(ordinals)} clouds fit each other, so no odometry can be made "
            f"of them. Look at the clouds with `graspe inspect`, or name an odometry topic."
        )
    odometry = _track(tracks.points, parts, np.array(ordinals, np.int64), robot)
    known = int(np.isfinite(odometry.position).all(axis=1).sum())
    text = (
        f"no odometry topic: poses are made from {known} of {len(ordinals)} clouds of {topic} by "
        f"KISS-ICP, and velocities fitted to them"
    )
    findings.append(
        Finding(
            "odometry_by_lidar", "mended", topic, text, {"poses": known, "clouds": len(ordinals)}
        )
    )
    return replace(tracks, odometry=odometry)


def _mounting(tracks: Tracks, robot: Robot) -> Transform:
    """The lidar's mounting in the base, which must not move.

    Raises:
        RecordingError: It is not known.
    """
    declared = declared_mounting(robot, "lidar")
    if declared is not None:
        return declared
    frame = plain_frame(robot.lidar.frame or tracks.points_frame)
    edges = sort_edges(tracks.edges)
    transforms = TransformBuffer(edges.fixed_edges(lambda track: track.stamps.bag_ns))
    try:
        return transforms.changes(robot.base_frame, frame)[-1][1]
    except GeometryError as error:
        raise RecordingError(f"Odometry by the lidar needs its mounting. {error}") from error


def _track(
    points: StampTrack, parts: list[LidarOdometry], ordinals: Stamps, robot: Robot
) -> MotionTrack:
    """The poses as odometry of the base at the clouds' stamps."""
    found = [part.result() for part in parts]
    position = np.concatenate([positions for _, positions, _ in found])
    quaternion = np.concatenate([quaternions for _, _, quaternions in found])
    velocity = np.concatenate([fitted_velocities(*part) for part in found])
    twist = np.zeros((position.shape[0], 6))
    twist[:, 0], twist[:, 5] = velocity.T
    stamped = np.isin(ordinals, points.ordinal)
    stamps = replace(points.only(np.isin(points.ordinal, ordinals)), topic=robot.topics.odometry)
    frames = robot.odometry_frame, robot.base_frame
    return MotionTrack(stamps, position[stamped], quaternion[stamped], twist[stamped], *frames)
