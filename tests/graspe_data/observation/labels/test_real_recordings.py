"""Recordings of robots to which nothing happened, or nothing that the rules should miss."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from graspe_data.geometry import roll_pitch_yaw, rotation_from_quaternion
from graspe_data.observation.labels import (
    CommandSeries,
    Decided,
    LabelSettings,
    MotionSeries,
    OdometrySeries,
    ProposalSettings,
    label_rows,
    propose,
)
from graspe_data.recordings.decoding import decode_motion
from graspe_data.recordings.recording import open_recording
from graspe_data.sensor_data import Motion


def motions(path: Path, topic: str) -> list[tuple[int, Motion]]:
    with open_recording(path) as recording:
        kind = recording.topics[topic].message_type
        return [
            (raw.bag_time_ns, decode_motion(recording.decode(raw), kind, topic))
            for raw in recording.messages([topic])
        ]


def odometry(samples: list[tuple[int, Motion]]) -> OdometrySeries:
    stamps, first = np.unique([motion.stamp_ns or 0 for _, motion in samples], return_index=True)
    kept = [samples[i][1] for i in first]
    position = np.array([motion.position for motion in kept], np.float64)
    rotation = rotation_from_quaternion(np.array([motion.quaternion for motion in kept]))
    roll, pitch, yaw = roll_pitch_yaw(rotation)
    v = np.array([motion.linear_velocity for motion in kept], np.float64)
    omega = np.array([motion.yaw_rate for motion in kept], np.float64)
    x, y, _ = position.T
    return OdometrySeries(stamps, x, y, np.unwrap(yaw), v, omega, roll, pitch)


def test_a_car_that_brakes_behind_traffic_does_not_fail(recordings: Path) -> None:
    path = recordings / "kitti_street_camera_lidar_odometry"
    series = odometry(motions(path, "/odometry"))
    proposals = propose(MotionSeries(series), ProposalSettings())
    assert proposals.events == ()
    assert set(proposals.unavailable) == {"stuck"}
    second = LabelSettings(steps=10, step_s=0.1)
    labels = label_rows(series.stamps_ns[:-10], series, Decided(), second)
    assert labels.mask.mean() > 0.9
    assert np.all(labels.success[labels.mask] == 1)


def test_a_robot_that_follows_its_commands_is_not_stuck(recordings: Path) -> None:
    path = recordings / "zaki_scan_odom_tf_clockdrift.bag"
    samples = motions(path, "/odom")
    skew = round(np.median([stamp - (motion.stamp_ns or 0) for stamp, motion in samples]))
    sent = motions(path, "/cmd_vel")
    stamps, first = np.unique([stamp - skew for stamp, _ in sent], return_index=True)
    v = np.array([sent[i][1].linear_velocity for i in first], np.float64)
    omega = np.array([sent[i][1].yaw_rate for i in first], np.float64)
    series = MotionSeries(odometry(samples), CommandSeries(stamps, v, omega))
    assert propose(series, ProposalSettings()).events == ()
