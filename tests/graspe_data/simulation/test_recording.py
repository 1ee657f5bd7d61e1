"""Recordings of a small scenario, read back: they are whole, repeatable, and know the truth."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from graspe_data.geometry import Transform
from graspe_data.known_outcomes import read_outcomes
from graspe_data.manifest import find_manifest, load_manifest
from graspe_data.observation.labels import annotation_path, read_annotation
from graspe_data.recordings import RawMessage, open_recording, recording_digest
from graspe_data.recordings.decoding import (
    decode_calibration,
    decode_image,
    decode_inertial,
    decode_motion,
    decode_points,
    decode_transforms,
)
from graspe_data.recordings.writing import Container
from graspe_data.robot import Robot
from graspe_data.simulation.message_stream import START_NS
from graspe_data.simulation.recorded_truth import (
    CANDIDATES_TOPIC,
    RecordedTruth,
    read_scenario_text,
    read_truth,
    scenario_text,
    truth_path,
)
from graspe_data.simulation.recording import record_scenario
from graspe_data.simulation.scenario import Scenario
from graspe_data.simulation.simulated_drive import SimulatedDrive, simulate_drive
from graspe_data.simulation.truth.outlook import arc_success

ODOMETRY, IMU, COMMAND = "/spot/odometry", "/imu/data", "/cmd_vel"
PICTURE, CLOUD = "/camera/color/image_raw/compressed", "/velodyne_points"
CALIBRATION = "/camera/color/camera_info"
COUNTS = {
    "/tf_static": 1,
    "/tf": 100,
    ODOMETRY: 100,
    IMU: 200,
    COMMAND: 20,
    CALIBRATION: 4,
    PICTURE: 4,
    CLOUD: 4,
    "/truth/scenario": 1,
    "/truth/trajectories": 4,
    "/truth/candidates": 4,
    "/truth/events": 1,
}
TURN_NS = 100_000_000
DELAYS = {ODOMETRY: 3, "/tf": 3, IMU: 2, PICTURE: 21, CALIBRATION: 20, CLOUD: 105}
SCENARIO = Scenario.model_validate(
    {
        "name": "small",
        "duration_s": 2.0,
        "world": {
            "length": 12.0,
            "width": 10.0,
            "ground": {"amplitude": 0.03, "wavelength": 5.0, "cell": 0.5},
            "features": [{"kind": "pillar", "at": [[3.0, 0.0], [4.0, 2.0], [-3.0, -2.0]]}],
        },
        "camera": {"width": 80, "height": 60, "rate": 2.0},
        "lidar": {"rate": 2.0, "sub_rays": 1},
    }
)


class Told:
    """A recording, decoded: (raw, message) pairs by topic."""

    def __init__(self, path: Path) -> None:
        self.path, self.truth = path, read_truth(path)
        self.by_topic: dict[str, list[tuple[RawMessage, Any]]] = {}
        with open_recording(path) as recording:
            self.types = {name: info.message_type for name, info in recording.topics.items()}
            self.losses = recording.losses
            for raw in recording.messages():
                self.by_topic.setdefault(raw.topic, []).append((raw, recording.decode(raw)))

    def on(self, topic: str) -> list[Any]:
        return [message for _, message in self.by_topic[topic]]


@pytest.fixture(scope="module")
def spot() -> Robot:
    return load_manifest(find_manifest("robots", "spot"), Robot)


@pytest.fixture(scope="module")
def simulated(spot: Robot) -> SimulatedDrive:
    return simulate_drive(SCENARIO, spot, seed=3, threads=1)


def write(folder: Path, robot: Robot, container: Container, seed: int = 3) -> tuple[Path, Any]:
    folder.mkdir(exist_ok=True)
    path = folder / ("drive.bag" if container == "bag" else "drive")
    return path, record_scenario(SCENARIO, robot, seed, path, container, threads=1)


@pytest.fixture(scope="module")
def told(spot: Robot, tmp_path_factory: pytest.TempPathFactory) -> Told:
    return Told(write(tmp_path_factory.mktemp("told"), spot, "mcap")[0])


def test_the_same_seed_gives_the_same_bytes_and_another_others(
    told: Told, spot: Robot, tmp_path: Path
) -> None:
    again, _ = write(tmp_path / "again", spot, "mcap")
    other, _ = write(tmp_path / "other", spot, "mcap", seed=4)
    digests = [recording_digest(path) for path in (told.path, again, other)]
    assert digests[0] == digests[1] != digests[2]


@pytest.mark.parametrize("container", ["bag", "db3"])
def test_every_container_tells_the_same_at_the_same_times(
    container: Container, told: Told, spot: Robot, tmp_path: Path
) -> None:
    other = Told(write(tmp_path, spot, container)[0])
    assert other.types == told.types
    for topic, pairs in told.by_topic.items():
        times = [[raw.bag_time_ns for raw, _ in each] for each in (pairs, other.by_topic[topic])]
        assert times[0] == times[1]
    for topic in (PICTURE, CLOUD):
        for one, two in zip(told.on(topic), other.on(topic), strict=True):
            np.testing.assert_array_equal(one.data, two.data)


def test_topics_come_at_their_rates(told: Told) -> None:
    assert {topic: len(pairs) for topic, pairs in told.by_topic.items()} == COUNTS
    assert told.losses == []


@pytest.mark.parametrize("topic", DELAYS)
def test_messages_reach_the_recorder_a_little_after_their_stamp(told: Told, topic: str) -> None:
    expected = START_NS + np.arange(COUNTS[topic]) * (2 * 10**9 // COUNTS[topic])
    headers = [(said.transforms[0] if topic == "/tf" else said).header for said in told.on(topic)]
    stamps = np.array([h.stamp.sec * 10**9 + h.stamp.nanosec for h in headers])
    phase = stamps[0] - START_NS
    assert (stamps == expected[: len(stamps)] + phase).all()
    assert phase == 0 or (topic == "/velodyne_points" and phase < TURN_NS)
    late = np.array([raw.bag_time_ns for raw, _ in told.by_topic[topic]]) - stamps
    least = DELAYS[topic] * 1_000_000
    assert least <= late.min() <= late.max() < least + 2_000_000


def test_odometry_and_its_transform_are_what_the_drive_reports(
    told: Told, simulated: SimulatedDrive
) -> None:
    driven = simulated.driven
    for step, said, moved in zip(range(0, 200, 2), told.on(ODOMETRY), told.on("/tf"), strict=True):
        motion = decode_motion(said, told.types[ODOMETRY], ODOMETRY)
        (edge,) = decode_transforms(moved)
        assert (motion.position, motion.quaternion) == (edge.translation, edge.quaternion)
        assert motion.position is not None
        assert motion.position[:2] == pytest.approx(driven.odometry[step, :2])
        assert (motion.linear_velocity, motion.yaw_rate) == pytest.approx(driven.measured[step])
        body = Transform.from_quaternion(np.zeros(3), np.array(edge.quaternion)).rotation
        level = driven.base_pose(float(driven.time_s[step])).rotation
        np.testing.assert_allclose(body[2], level[2], atol=1e-9)


def test_the_base_starts_at_its_height_over_the_origin_of_the_odometry(told: Told) -> None:
    motion = decode_motion(told.on(ODOMETRY)[0], told.types[ODOMETRY], ODOMETRY)
    assert motion.position == pytest.approx((0.0, 0.0, 0.5), abs=1e-6)


def test_commands_are_those_that_the_robot_was_given(told: Told, simulated: SimulatedDrive) -> None:
    said = [(each.linear.x, each.angular.z) for each in told.on(COMMAND)]
    np.testing.assert_allclose(said, simulated.driven.command[::10])


def test_the_imu_feels_the_drive_with_noise(told: Told, simulated: SimulatedDrive) -> None:
    samples = [decode_inertial(said, IMU) for said in told.on(IMU)]
    felt = np.array([sample.linear_acceleration for sample in samples])
    turned = np.array([sample.angular_velocity for sample in samples])
    assert 0.05 < (felt - simulated.driven.acceleration).std() < 0.12
    assert 0.002 < (turned - simulated.driven.gyro).std() < 0.007


def test_mountings_and_calibration_are_those_of_the_scenario(told: Told) -> None:
    edges = {
        (edge.parent, edge.child): edge for edge in decode_transforms(told.on("/tf_static")[0])
    }
    assert set(edges) == {("base_link", "camera_optical"), ("base_link", "velodyne")}
    lidar = edges["base_link", "velodyne"]
    assert tuple(lidar.translation) == SCENARIO.lidar.mounting.translation
    camera = decode_calibration(told.on(CALIBRATION)[0], CALIBRATION).intrinsics
    assert (camera.width, camera.height) == (80, 60)
    ahead = edges["base_link", "camera_optical"]
    optical = Transform.from_quaternion(np.array(ahead.translation), np.array(ahead.quaternion))
    looks = optical.rotation @ (0.0, 0.0, 1.0)
    pitch = SCENARIO.camera.mounting.rotation_rpy[1]
    np.testing.assert_allclose(looks, (np.cos(pitch), 0.0, -np.sin(pitch)), atol=1e-9)


def test_pictures_and_clouds_show_something(told: Told) -> None:
    for said in told.on(PICTURE):
        rgb = decode_image(said, told.types[PICTURE], PICTURE).rgb
        assert rgb.shape == (60, 80, 3)
        assert rgb.std() > 5
    for said in told.on(CLOUD):
        cloud = decode_points(said, CLOUD)
        assert len(cloud.xyz) > 5000
        assert cloud.ring is not None
        assert np.unique(cloud.ring).tolist() == list(range(16))


def test_clouds_put_the_pillars_where_they_stand(told: Told, simulated: SimulatedDrive) -> None:
    cloud = decode_points(told.on(CLOUD)[0], CLOUD)
    base = simulated.driven.base_pose(0.0) @ simulated.lidar.base_from_lidar
    points = base.apply(cloud.xyz.astype(np.float64))
    radius = np.linalg.norm(points[:, :2] - (3.0, 0.0), axis=1)
    high = points[:, 2] > 0.4
    assert (high & (radius < 0.6)).sum() > 20


def test_the_truth_is_told_and_lies_beside(told: Told, spot: Robot) -> None:
    truth: RecordedTruth = told.truth
    assert truth.stamps_ns.tolist() == [START_NS + k * 500_000_000 for k in range(4)]
    assert truth.success.shape == (4, 10)
    assert (np.diff(truth.success.astype(int), axis=1) <= 0).all()
    beside = read_annotation(truth_path(told.path), recording_digest(told.path))
    assert tuple(beside.event(interval) for interval in beside.intervals) == truth.events
    assert not annotation_path(told.path).exists()
    assert read_scenario_text(told.path) == scenario_text(SCENARIO, spot, 3)


def test_candidates_are_within_the_limits_and_judged_by_the_world(
    told: Told, simulated: SimulatedDrive
) -> None:
    known, driven = read_outcomes(told.path, CANDIDATES_TOPIC), simulated.driven
    np.testing.assert_array_equal(known.stamps_ns, told.truth.stamps_ns)
    linear, yaw = np.moveaxis(known.velocities, 2, 0)
    assert 0.15 <= linear.min() < linear.max() <= 0.6
    assert -0.6 <= yaw.min() < 0 < yaw.max() <= 0.6
    assert not told.truth.events
    poses = np.column_stack([driven.position[:, :2], driven.attitude[:, 2]])[::50]
    for pose, velocities, success in zip(poses, known.velocities, known.success, strict=True):
        asked = np.broadcast_to(pose, (len(velocities), 3))
        expected = arc_success(simulated.world, simulated.robot, asked, velocities)
        np.testing.assert_array_equal(success, expected)
