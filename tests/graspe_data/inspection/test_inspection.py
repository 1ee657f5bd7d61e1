from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from graspe_data.errors import RecordingError
from graspe_data.inspection.inspection import Inspection, TopicReport, inspect_recording
from graspe_data.inspection.topic_content import (
    CloudContent,
    MotionContent,
    PictureContent,
    ScanContent,
)
from graspe_data.manifest import find_manifest, load_manifest
from graspe_data.recordings import RecordingWriter
from graspe_data.recordings.writing import Container
from graspe_data.robot import Robot
from graspe_data.simulation.message_stream import START_NS, MessageStream
from graspe_data.simulation.motion.drivers import Leg
from tests.conftest import GardenDrive

IMAGE, CLOUD, ODOMETRY = "/camera/color/image_raw/compressed", "/velodyne_points", "/spot/odometry"
Message = tuple[str, Any, int]
Change = Callable[[Message], Message | None]


@pytest.fixture(scope="module")
def messages(garden_drive: GardenDrive) -> list[Message]:
    """Ten seconds of all sensors: topic, message, bag time."""
    driven = garden_drive((Leg(10.0, 0.6, 0.6),), camera={"width": 80, "height": 60})
    return [(m.topic, m.content, m.stamp_ns + m.delay_ns) for m in MessageStream(driven)]


@pytest.fixture
def inspect(tmp_path: Path, messages: list[Message]) -> Callable[..., Inspection]:
    """Record the drive with every message changed, or left out, and inspect it."""

    def record(
        change: Change = lambda message: message,
        container: Container = "mcap",
        robot: Robot | None = None,
    ) -> Inspection:
        path = tmp_path / ("drive.bag" if container == "bag" else f"drive_{container}")
        with RecordingWriter(path, container) as writer:
            for message in messages:
                changed = change(message)
                if changed is not None:
                    writer.write(*changed)
        return inspect_recording(path, robot)

    return record


def topic(inspection: Inspection, name: str) -> TopicReport:
    return next(found for found in inspection.topics if found.name == name)


def shifted(chosen: str, seconds: Callable[[float], float]) -> Change:
    """Move the header stamps of one topic by so many seconds, a function of their time."""

    def change(message: Message) -> Message:
        name, content, bag_ns = message
        if name != chosen:
            return message
        stamp = content.header.stamp
        at_ns = stamp.sec * 10**9 + stamp.nanosec
        moved_ns = at_ns + round(seconds((at_ns - START_NS) / 1e9) * 1e9)
        moved = replace(stamp, sec=moved_ns // 10**9, nanosec=moved_ns % 10**9)
        return name, replace(content, header=replace(content.header, stamp=moved)), bag_ns

    return change


def without(*names: str) -> Change:
    return lambda message: None if message[0] in names else message


@pytest.mark.parametrize("container", ["bag", "db3", "mcap"])
def test_a_drive_with_all_sensors_can_make_rows(
    inspect: Callable[..., Inspection], container: Container
) -> None:
    found = inspect(container=container)
    assert found.verdict.possible, found.verdict.reasons
    assert found.verdict.notes == ()
    assert found.verdict.topics["image"] == IMAGE
    assert found.verdict.topics["points"] == CLOUD
    assert found.verdict.topics["odometry"] == ODOMETRY
    assert found.verdict.topics["camera_info"] == "/camera/color/camera_info"
    assert {(p.sensor, p.odometry): p.by_header for p in found.pairings} == {
        (IMAGE, ODOMETRY): topic(found, IMAGE).count,
        (CLOUD, ODOMETRY): topic(found, CLOUD).count,
    }


def test_contents_are_told(inspect: Callable[..., Inspection]) -> None:
    found = inspect()
    assert topic(found, IMAGE).content == PictureContent(80, 60, "jpeg")
    cloud = topic(found, CLOUD).content
    assert isinstance(cloud, CloudContent)
    assert cloud.rings == 16
    assert cloud.fields == ("x", "y", "z", "intensity", "ring", "time")
    motion = topic(found, ODOMETRY).content
    assert isinstance(motion, MotionContent)
    assert motion.child_frame == "base_link"
    assert motion.distance_m == pytest.approx(5.5, abs=0.6)
    assert topic(found, CLOUD).frame == "velodyne"


def test_the_json_is_plain_and_complete(inspect: Callable[..., Inspection]) -> None:
    found = inspect()
    plain = json.loads(json.dumps(found.to_json(), allow_nan=False))
    assert plain["messages"] == found.messages
    assert plain["verdict"]["possible"] is True
    assert [entry["name"] for entry in plain["topics"]] == [t.name for t in found.topics]


@pytest.mark.parametrize(("name", "role"), [(IMAGE, "image"), (CLOUD, "points")])
def test_a_missing_sensor_is_named(
    inspect: Callable[..., Inspection], name: str, role: str
) -> None:
    found = inspect(without(name))
    assert not found.verdict.possible
    assert found.verdict.reasons == (f"no topic that could serve as {role}",)


def test_unrelated_clocks_are_named_with_their_skew(inspect: Callable[..., Inspection]) -> None:
    found = inspect(shifted(ODOMETRY, lambda t: -100.0 - 3.0 * t))
    assert not found.verdict.possible
    assert ODOMETRY in found.verdict.reasons[0]
    assert "skew" in found.verdict.reasons[0]
    pairing = next(p for p in found.pairings if p.sensor == IMAGE)
    assert pairing.reason is not None


def test_missing_calibration_and_mounting_are_noted(inspect: Callable[..., Inspection]) -> None:
    found = inspect(without("/tf_static", "/camera/color/camera_info"))
    assert found.verdict.possible
    notes = " ".join(found.verdict.notes)
    assert "camera.intrinsics" in notes
    assert "camera.mounting" in notes
    assert "lidar.mounting" in notes


def test_a_manifest_is_held_to(inspect: Callable[..., Inspection]) -> None:
    spot = load_manifest(find_manifest("robots", "spot"), Robot)
    assert inspect(robot=spot).verdict.possible
    car = load_manifest(find_manifest("robots", "kitti_car"), Robot)
    reasons = inspect(robot=car, container="db3").verdict.reasons
    assert any("/kitti/velo/pointcloud, which the robot manifest names" in r for r in reasons)


def test_pictures_that_do_not_decode_are_counted(write: Callable[..., Path]) -> None:
    found = topic(inspect_recording(write("mcap")), "/camera")
    assert found.undecodable > 0
    assert found.fault is not None
    assert "neither a JPEG" in found.fault


def test_what_a_cut_recording_lost_is_told(
    write: Callable[..., Path], single: Callable[[Path], Path]
) -> None:
    file = single(write("mcap"))
    file.write_bytes(file.read_bytes()[: file.stat().st_size // 2])
    found = inspect_recording(file)
    assert 0 < found.messages < 120
    assert found.losses


def test_what_is_no_recording_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "words.db3"
    path.write_text("no recording")
    with pytest.raises(RecordingError, match=r"words\.db3"):
        inspect_recording(path)


def test_zaki_pairs_by_header_and_reports_skew_and_gap(recordings: Path) -> None:
    found = inspect_recording(recordings / "zaki_scan_odom_tf_clockdrift.bag")
    (pairing,) = found.pairings
    assert (pairing.messages, pairing.by_header, pairing.by_bag) == (920, 920, 879)
    scan = topic(found, "/scan")
    assert scan.content == ScanContent(726, 131)
    assert scan.time is not None
    assert scan.time.gaps is not None
    assert scan.time.gaps.longest_s == pytest.approx(5.0, abs=0.05)
    assert scan.time.skew is not None
    assert scan.time.skew.minimum_s == pytest.approx(-15.1, abs=0.05)
    assert scan.time.skew.maximum_s == pytest.approx(-7.5, abs=0.05)
    motion = topic(found, "/odom").content
    assert isinstance(motion, MotionContent)
    assert motion.distance_m == pytest.approx(16.0, abs=0.05)


def test_luminar_has_no_pair_by_either_clock_and_says_why(recordings: Path) -> None:
    found = inspect_recording(recordings / "embag_luminar_scan_odom_lz4.bag")
    pairing = next(p for p in found.pairings if p.sensor == "/luminar_pointcloud")
    assert (pairing.messages, pairing.by_header, pairing.by_bag) == (5, 0, 0)
    assert pairing.reason is not None
    assert "1583971517" in pairing.reason
    assert "6.830 s before" in pairing.reason
    assert not found.verdict.possible


def test_the_turtle_is_the_same_three_times(recordings: Path) -> None:
    found = [
        replace(inspect_recording(recordings / f"turtle_{name}.bag"), path=Path(), files=())
        for name in ("none", "bz2", "lz4")
    ]
    assert found[0].messages == 8647
    assert found[0] == found[1] == found[2]


@pytest.mark.parametrize("name", ["no_messages.bag", "rosbag2_compressed_bag"])
def test_no_messages_is_said_and_no_date(recordings: Path, name: str) -> None:
    found = inspect_recording(recordings / name)
    assert (found.messages, found.start_ns, found.end_ns, found.duration_s) == (0, None, None, 0.0)
    assert found.verdict.reasons == ("no messages",)


def test_kitti_can_make_rows(recordings: Path) -> None:
    found = inspect_recording(recordings / "kitti_street_camera_lidar_odometry")
    assert found.verdict.possible
    image = topic(found, "/kitti/camera_color_left/image_rect/compressed").time
    cloud = topic(found, "/kitti/velo/pointcloud").time
    assert image is not None
    assert image.skew is not None
    assert cloud is not None
    assert cloud.skew is not None
    assert 0.012 <= image.skew.minimum_s <= image.skew.maximum_s <= 0.035
    assert 0.060 <= cloud.skew.minimum_s <= cloud.skew.maximum_s <= 0.090
    assert cloud.rate_hz == pytest.approx(5.0)
    assert [(p.messages, p.by_header) for p in found.pairings] == [(78, 78), (39, 39)]
    assert "horizon" in found.verdict.notes[0]


def test_odometry_that_is_only_tf_is_paired(recordings: Path) -> None:
    found = inspect_recording(recordings / "akimap_loam_cloud_tf.bag")
    (pairing,) = found.pairings
    assert (pairing.odometry, pairing.by_header) == ("camera_init -> camera", 73)
    assert found.verdict.topics["odometry"] == "/tf"


def test_packets_without_definitions_are_points(recordings: Path) -> None:
    found = topic(inspect_recording(recordings / "nebula_vlp16"), "/velodyne_packets")
    assert isinstance(found.content, CloudContent)
    assert found.content.rings == 16
