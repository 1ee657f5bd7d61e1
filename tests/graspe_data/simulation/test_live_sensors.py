"""What a robot's sensors hand on while it drives is what a recording of the drive holds."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from graspe_data.manifest import find_manifest, load_manifest
from graspe_data.observation.observe import observe_points
from graspe_data.observation.settings import PointObservationSettings
from graspe_data.recordings.decoding import decode_image, decode_motion, decode_points
from graspe_data.robot import Robot
from graspe_data.sensor_data import PointCloud
from graspe_data.simulation.field import Field, build_field, part_generator
from graspe_data.simulation.live_odometry import LiveOdometry
from graspe_data.simulation.live_sensors import IMAGE_TYPE, LiveSensors
from graspe_data.simulation.message_stream import START_NS, MessageStream
from graspe_data.simulation.motion.drive_in_progress import DriveInProgress
from graspe_data.simulation.scenario import Scenario
from graspe_data.simulation.simulated_drive import SimulatedDrive

SCENARIO: dict[str, Any] = {
    "name": "small",
    "duration_s": 2.0,
    "world": {
        "length": 12.0,
        "width": 10.0,
        "ground": {"amplitude": 0.0, "cell": 1.0},
        "features": [{"kind": "pillar", "at": [[3.0, 0.0], [4.0, 2.0], [-3.0, -2.0]]}],
    },
    "camera": {"width": 80, "height": 60, "vibration": 0.0, "read_noise": 0.0},
    "lidar": {"sub_rays": 1, "range_noise": 0.0, "intensity_noise": 0.0, "dropout": 0.0},
    "motion": {"gait": {"bob": 0.0, "sway": 0.0}},
}
SPOT = load_manifest(find_manifest("robots", "spot"), Robot)
COVERED = [{"kind": "lens", "share": [1.0, 1.0], "every_s": [0.5, 0.5], "lasting_s": [9.0, 9.0]}]


def field_of(front_only: bool = False, **changes: Any) -> Field:
    scenario = Scenario.model_validate(SCENARIO | changes)
    return build_field(scenario, SPOT, 3, threads=1, front_only=front_only)


def way_through(field: Field, steps: int = 2) -> DriveInProgress:
    drawn = part_generator(field.scenario, field.seed, "motion")
    way = DriveInProgress(field.world, SPOT, field.scenario.motion, 2.0, drawn)
    way.advance((0.5, 0.2), steps)
    return way


@pytest.fixture(scope="module")
def field() -> Field:
    return field_of()


@pytest.fixture(scope="module")
def recorded(field: Field) -> dict[int, dict[str, Any]]:
    """The messages of the whole drive by stamp and topic."""
    way = way_through(field, 200)
    found: dict[int, dict[str, Any]] = {}
    for message in MessageStream(SimulatedDrive.through(field, way.drive())):
        found.setdefault(message.stamp_ns, {})[message.topic] = message.content
    return found


def cloud_of(message: Any) -> PointCloud:
    return decode_points(message, SPOT.topics.points)


def test_pictures_and_clouds_are_those_of_a_recording(
    field: Field, recorded: dict[int, dict[str, Any]]
) -> None:
    sensors, way = LiveSensors(field), way_through(field)
    for _ in range(15):
        way.advance((0.5, 0.2))
        picture, cloud = sensors.picture(way), sensors.cloud(way)
        if picture.stamp_ns >= START_NS:
            message = recorded[picture.stamp_ns][SPOT.topics.image]
            told = decode_image(message, IMAGE_TYPE, "").rgb.astype(float)
            assert np.abs(told - picture.rgb).mean() < 3.0
        if cloud.stamp_ns >= START_NS:
            told_cloud = cloud_of(recorded[cloud.stamp_ns][SPOT.topics.points])
            assert len(told_cloud.xyz) == len(cloud.xyz)
            np.testing.assert_allclose(cloud.xyz, told_cloud.xyz, atol=1e-4)


def test_they_come_as_late_as_in_a_recording(field: Field) -> None:
    sensors, way = LiveSensors(field), way_through(field, 50)
    now = START_NS + 500_000_000
    assert sensors.picture(way).stamp_ns == now - 100_000_000
    assert 110_000_000 <= now - sensors.cloud(way).stamp_ns < 310_000_000
    way.advance((0.5, 0.2), 12)
    assert sensors.picture(way).stamp_ns == now - 100_000_000
    way.advance((0.5, 0.2), 1)
    assert sensors.picture(way).stamp_ns == now + 100_000_000


def test_nothing_is_made_twice_or_for_nobody(field: Field) -> None:
    way = way_through(field, 50)
    often, once = LiveSensors(field), LiveSensors(field)
    first = often.picture(way)
    assert often.picture(way) is first
    way.advance((0.5, 0.2), 50)
    often.cloud(way)
    np.testing.assert_array_equal(often.picture(way).rgb, once.picture(way).rgb)
    np.testing.assert_array_equal(often.cloud(way).xyz, once.cloud(way).xyz)


def test_before_the_start_the_sensors_saw_the_standing_robots_world(field: Field) -> None:
    sensors, way = LiveSensors(field), way_through(field)
    assert sensors.picture(way).stamp_ns < START_NS
    assert sensors.picture(way).rgb.std() > 5
    assert len(sensors.cloud(way).xyz) > 5000


def test_covers_hide_what_they_hide_in_recordings() -> None:
    field = field_of(occlusions=COVERED)
    sensors, way = LiveSensors(field), way_through(field, 40)
    seen = sensors.picture(way).rgb
    way.advance((0.0, 0.0), 60)
    assert sensors.picture(way).rgb.mean() < 0.3 * seen.mean()


def test_the_front_of_the_lidar_is_all_that_an_observation_sees() -> None:
    settings = PointObservationSettings(rings=16, minimum_range=0.45, base_height=0.5)
    fields = [field_of(front_only) for front_only in (False, True)]
    clouds = [LiveSensors(field).cloud(way_through(field, 60)) for field in fields]
    assert len(clouds[1].xyz) < 0.72 * len(clouds[0].xyz)
    mounting = fields[0].lidar.base_from_lidar
    observed = [observe_points(cloud, mounting, settings, seed=1) for cloud in clouds]
    for name in ("points", "intensity", "smoothness", "laser_scan"):
        np.testing.assert_array_equal(*(getattr(each, name) for each in observed))


def test_odometry_is_that_of_a_recording_and_stands_before_the_start(
    field: Field, recorded: dict[int, dict[str, Any]]
) -> None:
    live, way = LiveOdometry(SPOT, 50.0, 1.0), way_through(field)
    for _ in range(12):
        way.advance((0.5, 0.2))
        motions = live.motions(way)
    stamps = [motion.stamp_ns for motion in motions]
    assert stamps == list(range(START_NS + 200_000_000, START_NS + 1_220_000_000, 20_000_000))
    for motion in motions:
        message = recorded[motion.stamp_ns or 0][SPOT.topics.odometry]
        told = decode_motion(message, "nav_msgs/msg/Odometry", "")
        assert motion.linear_velocity == told.linear_velocity
        assert motion.yaw_rate == told.yaw_rate
        assert motion.position == pytest.approx(told.position, abs=1e-6)
        assert motion.quaternion == pytest.approx(told.quaternion, abs=1e-6)
    standing = LiveOdometry(SPOT, 50.0, 1.0).motions(way_through(field))
    assert standing[0].stamp_ns == START_NS - 1_000_000_000
    assert {motion.linear_velocity for motion in standing[:-1]} == {0.0}


AILING = [
    {"kind": "glare", "strength": [1.0, 1.0]},
    {"kind": "droplets", "share": [0.6, 0.6]},
    {"kind": "dust", "strength": [1.0, 1.0]},
    {"kind": "near_leaves", "share": [0.6, 0.6]},
    {"kind": "thinned", "share": [0.6, 0.6]},
]


@pytest.mark.parametrize("ailing", AILING, ids=lambda ailing: str(ailing["kind"]))
def test_what_misleads_is_in_pictures_or_clouds_and_in_recordings_too(
    ailing: dict[str, Any], field: Field
) -> None:
    spells = {"every_s": [0.5, 0.5], "lasting_s": [9.0, 9.0]}
    failing, front = (field_of(front, occlusions=[ailing | spells]) for front in (False, True))
    way, sound = way_through(failing, 160), way_through(field, 160)
    picture, cloud = LiveSensors(failing).picture(way), LiveSensors(failing).cloud(way)
    plain, bare = LiveSensors(field).picture(sound), LiveSensors(field).cloud(sound)
    of_camera = ailing["kind"] in ("glare", "droplets")
    assert (picture.rgb.tobytes() != plain.rgb.tobytes()) == of_camera
    assert (cloud.xyz.tobytes() != bare.xyz.tobytes()) == (not of_camera)
    if ailing["kind"] in ("dust", "near_leaves"):
        assert len(cloud.xyz) > len(bare.xyz)
        near = np.linalg.norm(cloud.xyz, axis=1)
        assert near.min() > 0.4
        # A robot that looks ahead alone meets the same dust there.
        ahead = LiveSensors(front).cloud(way_through(front, 160)).xyz
        kept = {*map(tuple, ahead.tolist())}
        assert {*map(tuple, cloud.xyz[cloud.xyz[:, 0] > 0.1].tolist())} <= kept
    elif not of_camera:
        assert len(cloud.xyz) == pytest.approx(0.4 * len(bare.xyz), rel=0.15)


def test_a_frozen_camera_sends_one_picture_with_stamps_that_go_on() -> None:
    frozen = [{"kind": "frozen", "every_s": [0.5, 0.5], "lasting_s": [0.6, 0.6]}]
    field = field_of(occlusions=frozen)
    sensors, way = LiveSensors(field), way_through(field)
    pictures = []
    for _ in range(18):
        way.advance((0.5, 0.2), 10)
        pictures.append(sensors.picture(way))
    stamps = [picture.stamp_ns for picture in pictures]
    assert stamps == sorted(stamps)
    shown: dict[bytes, set[int]] = {}
    for picture in pictures:
        shown.setdefault(picture.rgb.tobytes(), set()).add(picture.stamp_ns)
    alike = sorted(len(times) for times in shown.values())
    assert alike[-1] == 4, "the picture of 0.4 s stands for those of 0.6, 0.8 and 1.0 s"
    assert alike[-2] == 1
