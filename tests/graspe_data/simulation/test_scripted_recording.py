"""Scripted recordings, read back: what the sensors say is what the world and the drive were."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from graspe_data.geometry import FrameTree, Transform
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
from graspe_data.robot import Intrinsics
from graspe_data.simulation import scripted_recording
from graspe_data.simulation.plain_world import TRUNK, WALL, Block, Trunk, World
from graspe_data.simulation.scripted_drive import GRAVITY, Leg, drive
from graspe_data.simulation.scripted_recording import (
    BASE_HEIGHT,
    REFLECTIVITY,
    RINGS,
    START_NS,
    Sensors,
    record_drive,
)

PICTURE, CLOUD = "/camera/color/image_raw/compressed", "/velodyne_points"
COUNTS = {
    "/tf_static": 1,
    "/spot/odometry": 50,
    "/imu/data": 100,
    "/cmd_vel": 10,
    "/camera/color/camera_info": 2,
    PICTURE: 2,
    CLOUD: 5,
}
DELAYS = {"/spot/odometry": 3, "/imu/data": 2, PICTURE: 21, CLOUD: 60}
SENSORS = Sensors(camera_rate=2, lidar_rate=5)
WALL_AHEAD = Block((4.0, 4.5), (-0.5, 1.0), 1.0)
TRUNK_BEHIND = Trunk(-3.0, 0.5, 0.3, 4.0)
WORLD = World(trunks=(TRUNK_BEHIND,), blocks=(WALL_AHEAD,))
DRIVEN = drive([Leg(1.0, 0.6, 0.5)], start=(0.3, -0.2, 0.1))


class Told:
    """A recording, decoded: (raw, message) pairs by topic."""

    def __init__(self, path: Path) -> None:
        self.by_topic: dict[str, list[tuple[RawMessage, Any]]] = {}
        with open_recording(path) as recording:
            self.types = {name: info.message_type for name, info in recording.topics.items()}
            self.losses = recording.losses
            for raw in recording.messages():
                self.by_topic.setdefault(raw.topic, []).append((raw, recording.decode(raw)))

    def on(self, topic: str) -> list[Any]:
        return [message for _, message in self.by_topic[topic]]

    @property
    def frames(self) -> FrameTree:
        edges = {}
        for edge in decode_transforms(self.on("/tf_static")[0]):
            pose = Transform.from_quaternion(np.array(edge.translation), np.array(edge.quaternion))
            edges[edge.parent, edge.child] = pose
        return FrameTree(edges)

    @property
    def intrinsics(self) -> Intrinsics:
        topic = "/camera/color/camera_info"
        return decode_calibration(self.on(topic)[0], topic).intrinsics

    def base_at(self, stamp_ns: int) -> Transform:
        """The pose of base_link, heights above the ground, that the odometry gives."""
        topic = "/spot/odometry"
        motions = [decode_motion(said, self.types[topic], topic) for said in self.on(topic)]
        motion = next(said for said in motions if said.stamp_ns == stamp_ns)
        assert motion.position is not None
        assert motion.quaternion is not None
        return Transform.from_quaternion(np.array(motion.position), np.array(motion.quaternion))


def write(folder: Path, container: Container, seed: int = 0, sensors: Sensors = SENSORS) -> Path:
    folder.mkdir(exist_ok=True)
    path = folder / ("drive.bag" if container == "bag" else "drive")
    record_drive(path, container, WORLD, DRIVEN, sensors, seed)
    return path


@pytest.fixture(scope="module", autouse=True)
def coarse_lidar() -> Any:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(scripted_recording, "COLUMNS", 360)
        yield


@pytest.fixture(scope="module")
def told(tmp_path_factory: pytest.TempPathFactory) -> Told:
    return Told(write(tmp_path_factory.mktemp("told"), "mcap"))


@pytest.mark.parametrize("container", ["bag", "db3", "mcap"])
def test_the_same_seed_gives_the_same_bytes_and_another_others(
    container: Container, tmp_path: Path
) -> None:
    seeds = {"first": 3, "again": 3, "other": 4}
    first, again, other = (
        recording_digest(write(tmp_path / name, container, seed)) for name, seed in seeds.items()
    )
    assert first == again != other


@pytest.mark.parametrize("container", ["bag", "db3"])
def test_every_container_tells_the_same(container: Container, told: Told, tmp_path: Path) -> None:
    other = Told(write(tmp_path, container))
    assert other.types == told.types
    for topic in (PICTURE, CLOUD):
        for one, two in zip(told.on(topic), other.on(topic), strict=True):
            assert one.header.stamp.nanosec == two.header.stamp.nanosec
            np.testing.assert_array_equal(one.data, two.data)


def test_topics_come_at_their_rates(told: Told) -> None:
    assert {topic: len(pairs) for topic, pairs in told.by_topic.items()} == COUNTS
    assert told.losses == []


@pytest.mark.parametrize("topic", DELAYS)
def test_messages_reach_the_recorder_a_little_after_their_stamp(told: Told, topic: str) -> None:
    expected = START_NS + np.arange(COUNTS[topic]) * (10**9 // COUNTS[topic])
    stamps = [said.header.stamp.sec * 10**9 + said.header.stamp.nanosec for said in told.on(topic)]
    assert stamps == expected.tolist()
    late = np.array([raw.bag_time_ns for raw, _ in told.by_topic[topic]]) - expected
    least = DELAYS[topic] * 1_000_000
    assert least <= late.min() < late.max() < least + 2_000_000


def test_odometry_is_the_drive(told: Told) -> None:
    topic = "/spot/odometry"
    for step, said in zip(range(0, 100, 2), told.on(topic), strict=True):
        motion = decode_motion(said, told.types[topic], topic)
        x, y, yaw = DRIVEN.pose[step]
        assert motion.position == pytest.approx((x, y, BASE_HEIGHT))
        assert motion.quaternion == pytest.approx((0, 0, np.sin(yaw / 2), np.cos(yaw / 2)))
        v, omega = motion.linear_velocity, motion.yaw_rate
        assert (v, omega) == pytest.approx(tuple(DRIVEN.velocity[step]))


def test_commands_are_those_of_the_script(told: Told) -> None:
    commands = [(said.linear.x, said.angular.z) for said in told.on("/cmd_vel")]
    assert commands == [(0.6, 0.5)] * 10


def test_the_imu_measures_the_drive_and_some_noise(told: Told) -> None:
    samples = [decode_inertial(said, "/imu/data") for said in told.on("/imu/data")]
    turn = [sample.angular_velocity[2] for sample in samples]
    np.testing.assert_allclose(turn, DRIVEN.velocity[:, 1])
    shaken = np.array([sample.linear_acceleration for sample in samples]) - DRIVEN.acceleration
    assert np.abs(shaken.mean(axis=0)).max() < 4 * 0.15 / np.sqrt(len(samples))
    np.testing.assert_allclose(shaken.std(axis=0), 0.15, rtol=0.3)
    assert np.mean([sample.linear_acceleration[2] for sample in samples]) > GRAVITY - 0.1


def test_the_lasers_lie_at_the_angles_of_a_vlp_16(told: Told) -> None:
    for said in told.on(CLOUD):
        cloud = decode_points(said, CLOUD)
        assert cloud.ring is not None
        level = np.hypot(cloud.xyz[:, 0], cloud.xyz[:, 1])
        elevation = np.degrees(np.arctan2(cloud.xyz[:, 2], level))
        np.testing.assert_allclose(elevation, 2.0 * cloud.ring - 15.0, atol=1e-3)
        assert set(np.unique(cloud.ring).tolist()) <= set(range(RINGS))


def in_the_world(told: Told, said: Any) -> tuple[NDArray[np.floating], NDArray[np.float32]]:
    """The points of a cloud in the frame of the world, and their intensities."""
    cloud = decode_points(said, CLOUD)
    lidar = told.base_at(cloud.stamp_ns) @ told.frames.lookup("base_link", cloud.frame)
    assert cloud.intensity is not None
    return lidar.apply(cloud.xyz.astype(np.float64)), cloud.intensity


def test_clouds_and_odometry_put_the_world_where_it_is(told: Told) -> None:
    for said in told.on(CLOUD):
        points, intensity = in_the_world(told, said)
        wall, trunk = (np.abs(intensity - REFLECTIVITY[what]) < 15 for what in (WALL, TRUNK))
        x, y, z = points[wall].T
        assert len(x) > 50
        assert np.abs(np.median(x) - 4.0) < 0.01
        assert -0.55 < y.min() < -0.4
        assert 0.9 < y.max() < 1.05
        assert z.max() < 1.05
        near = trunk & (points[:, 0] < -2) & (points[:, 2] > 0.1)
        centre = (TRUNK_BEHIND.x, TRUNK_BEHIND.y)
        away = np.linalg.norm(points[near][:, :2] - centre, axis=1)
        assert near.sum() > 20
        assert np.abs(away - TRUNK_BEHIND.radius).mean() < 0.03
        ground = np.abs(points[:, 2]) < 0.05
        assert ground.sum() > 1000
        assert abs(points[ground, 2].mean()) < 0.002


def wall_pixels(rgb: NDArray[np.uint8]) -> NDArray[np.bool_]:
    """Grey pixels; the sky is bluer than red, the ground redder than blue."""
    ratio = rgb[..., 2].astype(np.float64) / np.maximum(rgb[..., 0], 1)
    return np.asarray((ratio > 0.74) & (ratio < 1.1))


def test_known_points_are_seen_at_their_pixels(told: Told) -> None:
    for said in told.on(PICTURE):
        picture = decode_image(said, told.types[PICTURE], PICTURE)
        camera = told.base_at(picture.stamp_ns) @ told.frames.lookup("base_link", picture.frame)

        def pixel(x: float, y: float, z: float, camera: Transform = camera) -> tuple[int, int]:
            seen = told.intrinsics.matrix @ camera.inverse().apply(np.array([x, y, z]))
            u, v = np.round(seen[:2] / seen[2]).astype(int).tolist()
            return u, v

        wall = wall_pixels(picture.rgb)
        for y, outward in ((-0.5, 1), (1.0, -1)):
            u, v = pixel(4.0, y, 0.5)
            inside = wall[v - 3 : v + 4, u - 4 * outward]
            outside = wall[v - 3 : v + 4, u + 4 * outward]
            assert inside.mean() > 0.8
            assert outside.mean() < 0.2
        for z, outward in ((1.0, -1), (0.0, 1)):
            u, v = pixel(4.0, 0.25, z)
            assert wall[v - 4 * outward, u - 10 : u + 11].mean() > 0.8
            assert wall[v + 4 * outward, u - 10 : u + 11].mean() < 0.2


def test_the_calibration_is_that_of_the_picture(told: Told) -> None:
    camera, rgb = told.intrinsics, decode_image(told.on(PICTURE)[0], told.types[PICTURE], "").rgb
    assert rgb.shape == (camera.height, camera.width, 3) == (240, 320, 3)
    assert (camera.fx, camera.cx, camera.cy) == (240.0, 159.5, 119.5)
    assert (camera.distortion_model, camera.distortion) == ("none", ())


def test_dusk_is_darker(told: Told, tmp_path: Path) -> None:
    dim = Told(write(tmp_path, "mcap", sensors=replace(SENSORS, light=0.25)))
    day, dusk = (
        decode_image(said.on(PICTURE)[0], said.types[PICTURE], PICTURE).rgb.astype(np.float64)
        for said in (told, dim)
    )
    assert dusk.mean() / day.mean() == pytest.approx(0.25, abs=0.02)
