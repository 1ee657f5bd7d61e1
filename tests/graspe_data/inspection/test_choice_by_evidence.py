"""Which topics scaffold chooses: by how they run, not by what they are called."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from graspe_data.inspection.inspection import inspect_recording
from graspe_data.inspection.scaffolding import scaffold_robot
from graspe_data.inspection.several_robots import own_topics, robot_namespaces
from graspe_data.manifest import load_manifest
from graspe_data.robot import Intrinsics, Mounting, Robot
from tests.made_recordings import (
    CLOUD,
    IMAGE,
    MOUNTINGS,
    ODOMETRY,
    SECOND,
    START,
    STRAIGHT,
    TF,
    TYPES,
    Drive,
    Entry,
    MadeRecording,
    Pose,
    cloud,
    odometry,
    room,
    time_of,
    transforms,
)

Scaffold = Callable[..., tuple[str, Robot]]


@pytest.fixture
def scaffold(tmp_path: Path) -> Scaffold:
    def write(made: MadeRecording, *, resolve: bool = False) -> tuple[str, Robot]:
        text = scaffold_robot(made.write(tmp_path / "drive"), resolve=resolve)
        path = tmp_path / "robot.yaml"
        path.write_text(text, encoding="utf-8")
        return text, load_manifest(path, Robot)

    return write


def posed(made: MadeRecording, topic: str, kind: str, every_s: float) -> Iterator[Entry]:
    """Poses of the drive now and then."""
    for time_ns in range(START, START + 12 * SECOND, round(every_s * SECOND)):
        whole = odometry(time_ns, made.pose(time_ns), (0.0, 0.0), 0.0, ("map", ""))
        pose = whole.pose if "Covariance" in kind else whole.pose.pose
        yield topic, TYPES[f"geometry_msgs/msg/{kind}"](whole.header, pose), time_ns


@pytest.mark.parametrize(
    ("topic", "kind", "every_s"),
    [
        ("/move_base_simple/goal", "PoseStamped", 5.0),
        ("/a_goal", "PoseStamped", 3.0),
        ("/amcl_pose", "PoseWithCovarianceStamped", 0.9),
        ("/initialpose", "PoseWithCovarianceStamped", 11.0),
    ],
)
def test_a_pose_now_and_then_is_no_odometry(
    scaffold: Scaffold, topic: str, kind: str, every_s: float
) -> None:
    made = MadeRecording().without(ODOMETRY)
    edges = list(moving(made))
    made = made.plus([*posed(made, topic, kind, every_s), *edges])
    assert scaffold(made)[1].topics.odometry == TF


def moving(made: MadeRecording) -> Iterator[Entry]:
    for time_ns in made.times(50):
        pose = made.pose(time_ns)
        half = pose.yaw / 2
        turn = (0.0, 0.0, float(np.sin(half)), float(np.cos(half)))
        edge = ("odom", "base_link", (pose.x, pose.y, 0.0), turn)
        yield TF, transforms(time_ns, [edge]), time_ns + 2_000_000


def test_a_fixed_edge_is_no_odometry(scaffold: Scaffold) -> None:
    made = MadeRecording().without(ODOMETRY)
    fixed = [("odom", "base_link", (1.0, 0.0, 0.0), STRAIGHT)]
    made = made.plus([(TF, transforms(t, fixed), t) for t in made.times(50)])
    text, robot = scaffold(made)
    assert robot.topics.odometry == "/fill_in/odometry"
    assert "missing: no topic of the recording could serve" in text


def test_of_two_odometries_the_one_that_moves_is_taken(scaffold: Scaffold) -> None:
    made = MadeRecording()
    still = [
        ("/a/odom", odometry(t, Pose(0, 0, 0), (0.0, 0.0), 0.0), t + 1) for t in made.times(100)
    ]
    assert scaffold(made.plus(still))[1].topics.odometry == ODOMETRY


def renamed(made: MadeRecording, space: str) -> list[Entry]:
    return [(f"{space}{topic}", message, at_ns) for topic, message, at_ns in made.entries]


@pytest.mark.parametrize("lacking", [(), (ODOMETRY,), (CLOUD,)])
def test_camera_and_lidar_are_of_one_robot(scaffold: Scaffold, lacking: tuple[str, ...]) -> None:
    one, other = MadeRecording(), MadeRecording(Drive(v=1.2)).without(*lacking)
    both = [*renamed(one, "/zeta"), *renamed(other, "/alpha")]
    _, robot = scaffold(MadeRecording(entries=both))
    space = "/alpha" if not lacking else "/zeta"
    assert {robot.topics.image, robot.topics.points, robot.topics.odometry} == {
        f"{space}{topic}" for topic in (IMAGE, CLOUD, ODOMETRY)
    }


def test_each_robot_has_its_own_mounting(tmp_path: Path) -> None:
    high = (("base_link", "lidar", (1.5, 0.0, 2.0), STRAIGHT), MOUNTINGS[1])
    both = [
        *renamed(MadeRecording(), "/robot1"),
        *renamed(MadeRecording(mountings=high), "/robot2"),
    ]
    path = MadeRecording(entries=both).write(tmp_path / "two")
    text = scaffold_robot(path, resolve=True)
    assert "translation: [0.2, 0.0, 0.4]" in text
    notes = inspect_recording(path).verdict.notes
    assert "2 robots, /robot1, /robot2: these are the topics of /robot1" in notes[0]


def test_sensors_under_their_own_names_are_one_robot() -> None:
    candidates: Any = {
        "image": {"/camera/color/image_raw", "/ouster/signal_image"},
        "points": {"/ouster/points", "/camera/depth/points"},
        "odometry": {"/odometry/filtered"},
    }
    assert robot_namespaces(candidates) == []
    assert own_topics(candidates) == candidates


def test_what_tf_and_camera_info_say_can_be_written_as_numbers(scaffold: Scaffold) -> None:
    _, robot = scaffold(MadeRecording(), resolve=True)
    assert isinstance(robot.camera.intrinsics, Intrinsics)
    assert (robot.camera.intrinsics.fx, robot.camera.intrinsics.width) == (60.0, 64)
    assert isinstance(robot.lidar.mounting, Mounting)
    assert robot.lidar.mounting.translation == (0.2, 0.0, 0.4)
    assert isinstance(robot.camera.mounting, Mounting)
    expected = [[0, 0, 1], [-1, 0, 0], [0, -1, 0]]
    np.testing.assert_allclose(robot.camera.mounting.transform.rotation, expected, atol=1e-6)


def with_strength(strength: float, name: str = "intensity") -> MadeRecording:
    points = room()
    points["intensity"] = np.linspace(0, strength, points.size)
    points.dtype.names = tuple(
        name if field == "intensity" else field for field in points.dtype.names or ()
    )
    return MadeRecording().changed(CLOUD, lambda message: cloud(time_of(message), points))


@pytest.mark.parametrize(
    ("strength", "scale"), [(0.9, 1.0), (80.0, 255.0), (255.0, 255.0), (1854.0, 1854.0)]
)
def test_the_scale_of_intensity_is_what_was_seen(
    scaffold: Scaffold, strength: float, scale: float
) -> None:
    text, robot = scaffold(with_strength(strength))
    assert robot.lidar.intensity_maximum == scale
    assert f"the largest of a sample is {strength:.4g}" in text


def test_the_calibrated_strength_of_an_ouster_is_offered(scaffold: Scaffold) -> None:
    kind = [(n, "<f4") for n in ("x", "y", "z", "intensity", "reflectivity")]
    points = room()
    both = np.zeros(points.size, kind)
    for axis in ("x", "y", "z"):
        both[axis] = points[axis]
    both["intensity"], both["reflectivity"] = 1854, 90
    made = MadeRecording().changed(CLOUD, lambda message: cloud(time_of(message), both))
    _, robot = scaffold(made)
    assert robot.lidar.intensity_field == "reflectivity"
    assert robot.lidar.intensity_maximum == 255.0


def test_a_body_frame_gives_way_to_the_optical_one(scaffold: Scaffold) -> None:
    body = ("base_link", "cam", (0.3, 0.0, 0.3), STRAIGHT)
    optical = ("cam", "cam_optical_frame", (0.0, 0.0, 0.0), (-0.5, 0.5, -0.5, 0.5))
    text, robot = scaffold(MadeRecording(mountings=(MOUNTINGS[0], body, optical)))
    assert robot.camera.frame == "cam_optical_frame"
    assert "no optical frame" in text


def test_the_limits_are_those_of_the_body_whatever_the_twist_says(scaffold: Scaffold) -> None:
    made = MadeRecording(Drive(v=0.6, omega=0.0, heading=np.pi / 2))

    def fixed(message: Any) -> Any:
        return odometry(time_of(message), made.pose(time_of(message)), (0.0, 0.6), 0.0)

    text, robot = scaffold(made.changed(ODOMETRY, fixed))
    assert robot.limits.linear_velocity == (0.0, 0.6)
    assert "given in the odometry frame" in text


def test_a_recording_of_another_base_is_read_in_its_own(scaffold: Scaffold) -> None:
    edges = tuple(("body", child, place, turn) for _, child, place, turn in MOUNTINGS)
    made = MadeRecording(mountings=edges)
    made = made.changed(ODOMETRY, lambda message: replace(message, child_frame_id="body"))
    assert scaffold(made)[1].base_frame == "body"
