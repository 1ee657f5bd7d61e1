from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from graspe_data.errors import ManifestError, RecordingError
from graspe_data.inspection.manifest_lines import ManifestLine, manifest_text, unfilled
from graspe_data.inspection.scaffolding import scaffold_robot
from graspe_data.manifest import load_manifest
from graspe_data.recordings import RecordingWriter
from graspe_data.recordings.message_types import message_classes
from graspe_data.robot import Intrinsics, Mounting, Robot
from graspe_data.simulation.message_stream import MessageStream
from graspe_data.simulation.motion.drivers import Leg
from graspe_data.simulation.recording import record_drive
from graspe_data.simulation.simulated_drive import SimulatedDrive
from tests.conftest import GardenDrive

Load = Callable[[Path], tuple[str, Robot]]


@pytest.fixture
def load(tmp_path: Path) -> Load:
    """Scaffold a recording; gives the text and the manifest that it loads as."""

    def scaffold(recording: Path) -> tuple[str, Robot]:
        text = scaffold_robot(recording)
        path = tmp_path / "robot.yaml"
        path.write_text(text, encoding="utf-8")
        return text, load_manifest(path, Robot)

    return scaffold


@pytest.fixture(scope="module")
def driven(garden_drive: GardenDrive) -> SimulatedDrive:
    return garden_drive((Leg(2.0, 0.6, 0.1),), camera={"width": 80, "height": 60})


@pytest.fixture
def recorded(tmp_path: Path, driven: SimulatedDrive) -> Path:
    path = tmp_path / "Forest walk.mcap"
    record_drive(driven, path, "mcap")
    return path


def test_a_whole_recording_gives_the_robot_that_made_it(load: Load, recorded: Path) -> None:
    text, robot = load(recorded)
    assert robot.name == "forest_walk"
    assert robot.topics.image == "/camera/color/image_raw/compressed"
    assert robot.topics.points == "/velodyne_points"
    assert robot.topics.odometry == "/spot/odometry"
    assert robot.topics.command == "/cmd_vel"
    assert robot.topics.imu == "/imu/data"
    assert (robot.base_frame, robot.odometry_frame) == ("base_link", "odom")
    assert robot.base_height == pytest.approx(0.5, abs=0.06)
    assert (robot.lidar.model, robot.lidar.rings) == ("VLP-16", 16)
    assert robot.lidar.intensity_maximum == 255.0
    assert (robot.camera.intrinsics, robot.camera.mounting) == ("camera_info", "tf")
    assert robot.limits.linear_velocity[1] >= 0.6
    assert "from /camera/color/camera_info" in text
    assert "from tf_static" in text


def test_every_line_says_where_it_is_from(load: Load, recorded: Path) -> None:
    text, _ = load(recorded)
    lines = text.splitlines()[2:]
    values = [n for n, line in enumerate(lines) if ": " in line.partition("#")[0]]
    assert all("#" in lines[n] or lines[n - 1].strip().startswith("#") for n in values)


def test_a_constant_skew_is_suggested_as_offset(
    load: Load, driven: SimulatedDrive, tmp_path: Path
) -> None:
    path = tmp_path / "late.bag"
    with RecordingWriter(path, "bag") as writer:
        for message in MessageStream(driven):
            if message.topic == "/spot/odometry":
                header = message.content.header
                header.stamp = replace(header.stamp, sec=header.stamp.sec - 5)
            writer.write(message.topic, message.content, message.stamp_ns + message.delay_ns)
    text, robot = load(path)
    assert robot.clocks.odometry.offset_s == pytest.approx(5.0, abs=0.05)
    assert robot.clocks.points.offset_s == 0.0
    assert "guess: the constant difference" in text


def test_what_is_missing_is_marked_and_loads(load: Load, tmp_path: Path) -> None:
    classes: Any = message_classes()
    path = tmp_path / "words.bag"
    with RecordingWriter(path, "bag") as writer:
        writer.write("/words", classes["std_msgs/msg/String"]("hello"), 1)
    text, robot = load(path)
    assert robot.topics.image == "/fill_in/image"
    assert isinstance(robot.camera.mounting, Mounting)
    assert text.count("missing:") > 8


def test_hostile_topic_names_stay_one_value(load: Load, tmp_path: Path) -> None:
    classes: Any = message_classes()
    name = '/a: "b" # c\n- d\u2028\U0001f600'
    path = tmp_path / "hostile.bag"
    with RecordingWriter(path, "bag") as writer:
        twist = classes["geometry_msgs/msg/Twist"]
        vector = classes["geometry_msgs/msg/Vector3"]
        zero = vector(0.0, 0.0, 0.0)
        writer.write(name, twist(zero, zero), 1)
    _, robot = load(path)
    assert robot.topics.command == name


@given(text=st.text(st.characters(exclude_categories=["Cs"]), min_size=1))
def test_any_text_is_read_back_as_it_is(text: str) -> None:
    written = manifest_text(text, [ManifestLine(0, "key", "/" + text, text)])
    assert yaml.safe_load(written) == {"key": "/" + text}


def test_what_is_not_filled_in_is_listed(tmp_path: Path) -> None:
    path = tmp_path / "robot.yaml"
    lines = [
        ManifestLine(0, "name", "a # missing: no comment", "guess: x"),
        ManifestLine(0, "lidar"),
        ManifestLine(1, "minimum_range", 0.0, "missing: metres"),
        ManifestLine(1, "rings", "null", "missing: " + "so long that it stands above " * 4),
        ManifestLine(1, "model", "generic", "guess: it is not missing"),
        ManifestLine(0, "footprint", None, "missing: measure"),
        ManifestLine(1, "length", 1.0),
        ManifestLine(1, "limits", (0.0, 1.0), "missing: m/s"),
    ]
    path.write_text(manifest_text("a.bag", lines), encoding="utf-8")
    expected = ["lidar.minimum_range", "lidar.rings", "footprint", "footprint.limits"]
    assert unfilled(path) == expected


def test_a_manifest_edited_by_hand_is_still_read_for_marks(tmp_path: Path) -> None:
    path = tmp_path / "robot.yaml"
    path.write_text(
        "#missing: a note by hand\n# on two lines\na: {b: 1, c: 2}\n"
        "d:\n    e: 'x # missing'\n    f: [1,\n        2] #missing: y\ng: # missing: z\n",
        encoding="utf-8",
    )
    assert unfilled(path) == ["a", "d.f", "g"]
    path.write_text("- 1 # missing: it\n", encoding="utf-8")
    assert unfilled(path) == []
    path.write_text("a: [", encoding="utf-8")
    with pytest.raises(ManifestError, match="not valid YAML"):
        unfilled(path)


def test_a_scaffold_lists_what_it_could_not_find(load: Load, recorded: Path) -> None:
    load(recorded)
    found = unfilled(recorded.parent / "robot.yaml")
    assert {"footprint.length", "footprint.width", "lidar.minimum_range"} <= set(found)


def test_no_messages_give_no_manifest(recordings: Path) -> None:
    with pytest.raises(RecordingError, match="no messages"):
        scaffold_robot(recordings / "no_messages.bag")


def test_kitti_gives_the_shipped_robot_but_for_its_body(load: Load, recordings: Path) -> None:
    text, robot = load(recordings / "kitti_street_camera_lidar_odometry")
    assert robot.base_height == 0.0
    assert "sees most low points 0.06 m above base_link" in text
    assert robot.camera.rectified
    assert robot.lidar.intensity_maximum == 1.0
    assert robot.camera.mounting == "tf"
    assert robot.lidar.mounting == "tf"
    assert "missing: measure the robot" in text


@pytest.mark.parametrize(
    ("name", "model"), [("nebula_vlp16", "VLP-16"), ("nebula_vlp32", "VLP-32C")]
)
def test_packets_tell_the_lidar(load: Load, recordings: Path, name: str, model: str) -> None:
    _, robot = load(recordings / name)
    assert robot.lidar.model == model


def test_every_real_recording_gives_a_manifest_that_loads(load: Load, recordings: Path) -> None:
    for path in sorted(recordings.glob("*.bag")):
        if path.name != "no_messages.bag":
            load(path)


def test_a_camera_without_calibration_is_to_be_calibrated(load: Load, recordings: Path) -> None:
    _, robot = load(recordings / "rosnumpy_rgb8_cloud15.bag")
    assert isinstance(robot.camera.intrinsics, Intrinsics)
