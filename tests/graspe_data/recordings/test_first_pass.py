"""The first pass: stamps, motion, calibration and frames of a whole recording."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from graspe_data.errors import RecordingError
from graspe_data.recordings import RecordingWriter, open_recording
from graspe_data.recordings.first_pass import read_tracks
from graspe_data.recordings.message_types import message_classes
from graspe_data.recordings.tracks import Tracks
from graspe_data.robot import Footprint, Limits, Robot, Topics
from graspe_data.simulation.plain_world import World
from graspe_data.simulation.scripted_drive import Leg, drive
from graspe_data.simulation.scripted_recording import START_NS, Sensors, record_drive

TOPICS = Topics(
    image="/camera/color/image_raw/compressed",
    camera_info="/camera/color/camera_info",
    points="/velodyne_points",
    odometry="/spot/odometry",
    command="/cmd_vel",
    imu="/imu/data",
)
ROBOT = Robot(
    name="robot",
    topics=TOPICS,
    limits=Limits(linear_velocity=(0, 1), yaw_rate=(-1, 1)),
    footprint=Footprint(length=1, width=0.5),
)
SENSORS = Sensors(camera_rate=2, lidar_rate=2, width=32, height=24)


def record(folder: Path) -> Path:
    path = folder / "drive"
    driven = drive([Leg(1, 0.5, 0.0), Leg(2, 0.5, 0.4)])
    record_drive(path, "mcap", World(), driven, SENSORS, seed=0)
    return path


def tracks(path: Path, robot: Robot = ROBOT) -> Tracks:
    with open_recording(path) as recording:
        return read_tracks(recording, robot)


def test_every_stamp_and_sample_is_there(tmp_path: Path) -> None:
    found = tracks(record(tmp_path))
    assert found.image.bag_ns.size == found.points.bag_ns.size == 6
    assert found.odometry.stamps.bag_ns.size == 150
    assert found.command is not None
    assert found.command.stamps.header_ns is None
    assert found.imu is not None
    assert found.imu.acceleration[:, 2].mean() == pytest.approx(9.81, abs=0.1)
    assert found.calibration is not None
    assert found.calibration.intrinsics.fx == 24
    assert found.image.header_ns is not None
    assert found.image.header_ns[0] == START_NS


def test_the_frames_connect_the_sensors(tmp_path: Path) -> None:
    frames = tracks(record(tmp_path)).frames
    np.testing.assert_allclose(frames.lookup("base_link", "velodyne").translation, [0.2, 0, 0.35])
    between = frames.lookup("velodyne", "camera_optical")
    np.testing.assert_allclose(between.translation, [0.2, 0.0, -0.1], atol=1e-9)


def test_velocities_can_be_taken_from_the_poses(tmp_path: Path) -> None:
    path = record(tmp_path)
    reported = tracks(path).odometry.velocity
    robot = ROBOT.model_copy(update={"odometry_velocity": "differentiated"})
    differentiated = tracks(path, robot).odometry.velocity
    assert not np.array_equal(reported, differentiated)
    np.testing.assert_allclose(differentiated[80:140], reported[80:140], atol=0.01)


def test_odometry_may_come_as_tf(tmp_path: Path) -> None:
    types: dict[str, Any] = {n.split("/")[-1]: c for n, c in message_classes().items()}
    path = tmp_path / "tf"
    source = record(tmp_path)
    with open_recording(source) as recording, RecordingWriter(path, "mcap") as writer:
        for raw in recording.messages():
            message: Any = recording.decode(raw)
            if raw.topic != TOPICS.odometry:
                writer.write(raw.topic, message, raw.bag_time_ns)
                continue
            pose = message.pose.pose
            edge = types["TransformStamped"](
                header=message.header,
                child_frame_id="base_link",
                transform=types["Transform"](
                    translation=types["Vector3"](
                        x=pose.position.x, y=pose.position.y, z=pose.position.z
                    ),
                    rotation=pose.orientation,
                ),
            )
            writer.write("/tf", types["TFMessage"](transforms=[edge]), raw.bag_time_ns)
    robot = ROBOT.model_copy(update={"topics": TOPICS.model_copy(update={"odometry": "/tf"})})
    by_tf, by_odometry = tracks(path, robot).odometry, tracks(source).odometry
    np.testing.assert_array_equal(by_tf.position, by_odometry.position)
    np.testing.assert_allclose(by_tf.velocity[80:140], by_odometry.velocity[80:140], atol=0.01)


def test_a_topic_that_is_not_there_is_named_with_those_that_are(tmp_path: Path) -> None:
    topics = TOPICS.model_copy(update={"points": "/lidar"})
    with pytest.raises(RecordingError, match=r"lacks.*points /lidar.*It holds:.*/velodyne_points"):
        tracks(record(tmp_path), ROBOT.model_copy(update={"topics": topics}))
