"""The first pass: stamps, motion, calibration and frames of a whole recording."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from graspe_data.errors import RecordingError
from graspe_data.recordings import open_recording
from graspe_data.robot import Footprint, Limits, Robot, Topics
from graspe_data.simulation.message_stream import START_NS
from graspe_data.simulation.motion.drivers import Leg
from graspe_data.simulation.recording import record_drive
from graspe_data.synchronisation.clocks import ClockSettings
from graspe_data.synchronisation.first_pass import read_tracks
from graspe_data.synchronisation.row_plan import SynchronisationSettings
from graspe_data.synchronisation.synchronised import SynchronisedRecording, synchronise
from graspe_data.synchronisation.tracks import Tracks
from tests.conftest import GardenDrive

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
SHORTEST = SynchronisationSettings(history_steps=1, horizon_s=0.1)
NO_ERRORS = {"scale": 0.0, "speed_noise": 0.0, "yaw_rate_noise": 0.0, "yaw_walk": 0.0}


@pytest.fixture(scope="module")
def recorded(garden_drive: GardenDrive, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Three seconds of smooth motion; the velocities of the odometry are those of its poses."""
    driven = garden_drive(
        (Leg(1, 0.5, 0.0), Leg(2, 0.5, 0.4)),
        camera={"width": 32, "height": 24, "rate": 2.0},
        lidar={"rate": 2.0},
        motion={"odometry": NO_ERRORS},
    )
    path = tmp_path_factory.mktemp("first_pass") / "drive"
    record_drive(driven, path, "mcap")
    return path


def tracks(path: Path, robot: Robot = ROBOT) -> Tracks:
    with open_recording(path) as recording:
        return read_tracks(recording, robot)


def synchronised(path: Path, robot: Robot = ROBOT) -> SynchronisedRecording:
    with open_recording(path) as recording:
        return synchronise(recording, robot, ClockSettings(), SHORTEST)


def test_every_stamp_and_sample_is_there(recorded: Path) -> None:
    found = tracks(recorded)
    assert found.image.bag_ns.size == found.points.bag_ns.size == 6
    assert found.odometry is not None
    assert found.odometry.stamps.bag_ns.size == 150
    assert found.command is not None
    assert found.command.stamps.header_ns is None
    assert found.imu is not None
    assert found.imu.acceleration[:, 2].mean() == pytest.approx(9.81, abs=0.1)
    assert found.calibration is not None
    assert found.calibration.intrinsics.fx == pytest.approx(16 / np.tan(1.17 / 2))
    assert found.image.header_ns is not None
    assert found.image.header_ns[0] == START_NS


def test_the_edges_connect_the_sensors(recorded: Path) -> None:
    found = synchronised(recorded).placement.transforms
    lidar = found.lookup("base_link", "velodyne", START_NS)
    np.testing.assert_allclose(lidar.translation, [0.2, 0, 0.35])
    between = found.lookup("velodyne", "camera_optical", START_NS)
    np.testing.assert_allclose(between.translation, [0.25, 0.0, -0.2], atol=1e-9)


def test_velocities_can_be_taken_from_the_poses(recorded: Path) -> None:
    reported = synchronised(recorded).odometry.velocity
    robot = ROBOT.model_copy(update={"odometry_velocity": "differentiated"})
    differentiated = synchronised(recorded, robot).odometry.velocity
    assert not np.array_equal(reported, differentiated)
    np.testing.assert_allclose(differentiated[80:140], reported[80:140], atol=0.01)


def test_odometry_may_come_as_tf(recorded: Path) -> None:
    robot = ROBOT.model_copy(update={"topics": TOPICS.model_copy(update={"odometry": "/tf"})})
    assert tracks(recorded, robot).odometry is None
    by_tf, by_topic = synchronised(recorded, robot).odometry, synchronised(recorded).odometry
    np.testing.assert_allclose(by_tf.pose, by_topic.pose, atol=1e-9)
    np.testing.assert_allclose(by_tf.velocity[80:140], by_topic.velocity[80:140], atol=0.01)


def test_a_topic_that_is_not_there_is_named_with_those_that_are(recorded: Path) -> None:
    topics = TOPICS.model_copy(update={"points": "/lidar"})
    with pytest.raises(RecordingError, match=r"lacks.*points /lidar.*It holds:.*/velodyne_points"):
        tracks(recorded, ROBOT.model_copy(update={"topics": topics}))
