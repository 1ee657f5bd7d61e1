"""One drive as the simulator and as the drivers of real robots write it: the rows are the same."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from graspe_data.manifest import find_manifest, load_manifest
from graspe_data.observation.point_sample import PointSampleSettings
from graspe_data.observation.settings import HorizonSettings, ImageSettings, PointSettings
from graspe_data.recordings.writing import Container, RecordingWriter
from graspe_data.robot import Robot
from graspe_data.simulation.habits.carried_clouds import clouds_in_odometry_frame
from graspe_data.simulation.habits.clouds import livox_messages, livox_points, ouster_points
from graspe_data.simulation.habits.odometry import twist_in_odometry_frame, twist_never_filled
from graspe_data.simulation.habits.recorded import (
    Habit,
    Recorded,
    frames_renamed,
    left_out,
    topics_renamed,
    with_habits,
)
from graspe_data.simulation.habits.robots import DRIVERS, Names, habits_of, spot_frames
from graspe_data.simulation.habits.transforms import (
    TF_STATIC,
    fixed_edges_on_tf,
    footprint_hop,
    inverted,
    mounting_in_hops,
)
from graspe_data.simulation.lidar.settings import LidarSettings
from graspe_data.simulation.message_stream import MessageStream
from graspe_data.simulation.motion.drivers import Leg
from graspe_data.synchronisation.row_plan import WindowSettings
from pipelines.dataset_settings import DatasetManifest, DatasetRecipe
from pipelines.episode import whole_column
from pipelines.process_recording import Episode, RecordingTask, process_recording
from tests.conftest import GardenDrive

LEGS = (Leg(2.5, 0.6, 0.0), Leg(1.5, 0.5, 0.4), Leg(2.0, 0.5, 0.2), Leg(2.5, -0.4, 0.5))
"""Into the bush, and out of it backwards; turning, so that the frames of a twist differ."""
MILLIMETRE = 1e-3
ON_AN_EDGE = 1e-4
"""Share of a scan's beams in which a return may be one beam beside: a cloud that was carried into
another frame and back is rounded, and a return on the edge of two beams falls to either."""
SENSOR = LidarSettings().mounting
EXTRACTED = ("stamp_ns", "points", "point_count", "laser_scan", "velocity_history", "pose")
RELIABILITIES = ("r_img", "r_edge", "r_planar", "r_point")
LABELS = ("success", "success_mask")
ROS_2 = ("spot_ros2", "go2_livox")

Rows = dict[str, NDArray[Any]]


@pytest.fixture(scope="module")
def spot() -> Robot:
    return load_manifest(find_manifest("robots", "spot"), Robot)


@pytest.fixture(scope="module")
def stream(garden_drive: GardenDrive) -> list[Recorded]:
    return [
        Recorded(message.topic, message.content, message.stamp_ns + message.delay_ns)
        for message in MessageStream(garden_drive(LEGS, lidar={"rate": 5.0}))
    ]


@pytest.fixture(scope="module")
def rows_of(
    tmp_path_factory: pytest.TempPathFactory, stream: list[Recorded]
) -> Callable[..., Rows]:
    """The rows of the drive as it is written under habits and read under a robot manifest."""

    def rows(habits: Sequence[Habit], robot: Robot, container: Container = "mcap") -> Rows:
        folder = tmp_path_factory.mktemp("habits")
        path = folder / ("drive.bag" if container == "bag" else "drive")
        with RecordingWriter(path, container) as writer:
            for message in with_habits(stream, habits):
                writer.write(message.topic, message.content, message.bag_time_ns)
        episode = process_recording(RecordingTask(path, _recipe(robot), folder / "episodes"))
        assert isinstance(episode, Episode), episode.reason
        names = {"extract": EXTRACTED, "reliability": RELIABILITIES, "label": LABELS}
        return {
            name: np.asarray(whole_column(episode.folders[stage], name))
            for stage, columns in names.items()
            for name in columns
        }

    return rows


def _recipe(robot: Robot) -> DatasetRecipe:
    manifest = DatasetManifest(
        name="habits",
        robot=robot.name,
        window=WindowSettings(anchor_rate=5.0, history_steps=10),
        horizon=HorizonSettings(steps=5, step_s=0.2),
        image=ImageSettings(width=80, height=60),
        points=PointSettings(sample=PointSampleSettings(count=16_000)),
    )
    return DatasetRecipe(dataset=manifest, robot=robot)


@pytest.fixture(scope="module")
def plain(rows_of: Callable[..., Rows], spot: Robot) -> Rows:
    rows = rows_of((), spot)
    assert len(rows["stamp_ns"]) > 15
    assert 0.1 < rows["success"][rows["success_mask"]].mean() < 0.9
    assert 0 < rows["point_count"].min() <= rows["point_count"].max() < 16_000
    return rows


def assert_same_motion(found: Rows, truth: Rows) -> None:
    np.testing.assert_array_equal(found["stamp_ns"], truth["stamp_ns"])
    velocities = found["velocity_history"], truth["velocity_history"]
    np.testing.assert_allclose(*velocities, rtol=0, atol=MILLIMETRE)
    np.testing.assert_allclose(found["pose"], truth["pose"], rtol=0, atol=MILLIMETRE)
    for name in LABELS:
        np.testing.assert_array_equal(found[name], truth[name])


def assert_same_points(found: Rows, truth: Rows) -> None:
    np.testing.assert_array_equal(found["point_count"], truth["point_count"])
    for mine, theirs, count in zip(
        found["points"], truth["points"], truth["point_count"], strict=True
    ):
        for one, other in ((mine, theirs), (theirs, mine)):
            away, _ = cKDTree(one[:count]).query(other[:count])
            assert away.max() < MILLIMETRE
    equal = np.isclose(found["laser_scan"], truth["laser_scan"], rtol=0, atol=MILLIMETRE)
    assert np.count_nonzero(~equal) <= ON_AN_EDGE * equal.size


def assert_same_rows(found: Rows, truth: Rows) -> None:
    assert_same_motion(found, truth)
    assert_same_points(found, truth)
    for name in RELIABILITIES:
        np.testing.assert_allclose(found[name], truth[name], rtol=0, atol=MILLIMETRE)


def under(name: str, spot: Robot, **changes: Any) -> Robot:
    """A shipped manifest with what the simulated robot's labels, ground and lidar are."""
    robot = load_manifest(find_manifest("robots", name), Robot)
    mine = {
        "limits": spot.limits,
        "footprint": spot.footprint,
        "base_height": spot.base_height,
        "lidar": robot.lidar.model_copy(
            update={"minimum_range": spot.lidar.minimum_range, "mounting": SENSOR}
        ),
    }
    return robot.model_copy(update=mine | changes)


def spots_names(spot: Robot, robot: Robot) -> list[Habit]:
    """The names of Spot's ROS 1 driver, beside an IMU that somebody has added."""
    ours, theirs = dict(spot.topics), dict(robot.topics)
    names = {topic: theirs[role] for role, topic in ours.items() if topic and theirs[role]}
    frames = {"base_link": robot.base_frame, "odom": robot.odometry_frame}
    frames["camera_optical"] = DRIVERS["spot_ros1"].camera_frame
    return [frames_renamed(frames), topics_renamed(names)]


def test_a_spot_in_all_of_its_drivers_habits_gives_the_rows_of_the_plain_one(
    rows_of: Callable[..., Rows], plain: Rows, spot: Robot
) -> None:
    robot = under("spot_ros1", spot)
    topics = robot.topics.model_copy(update={"imu": spot.topics.imu})
    robot = robot.model_copy(update={"topics": topics})
    habits = [*spot_frames(Names.of(spot)), *spots_names(spot, robot)]
    assert_same_rows(rows_of(habits, robot, "bag"), plain)


@pytest.mark.parametrize(
    ("name", "container"), [("spot_ros1", "bag"), ("spot_ros1", "mcap"), ("spot_ros2", "db3")]
)
def test_a_spot_whose_clouds_are_positions_alone_gives_the_same_points_and_motion(
    rows_of: Callable[..., Rows], plain: Rows, spot: Robot, name: str, container: Container
) -> None:
    found = rows_of(habits_of(name, spot), under(name, spot), container)
    assert_same_motion(found, plain)
    assert_same_points(found, plain)


SINGLE: dict[str, list[Habit]] = {
    "twist in odom": [twist_in_odometry_frame("/spot/odometry")],
    "clouds in odom": [clouds_in_odometry_frame("/velodyne_points", "/spot/odometry")],
    "fixed edges on tf alone": [fixed_edges_on_tf()],
    "mountings in hops": [mounting_in_hops("chassis_link")],
    "inverted odometry edge": [inverted("odom", "base_link")],
    "footprint hop": [footprint_hop("odom", "base_link", "base_footprint")],
    "tf_static under a namespace": [topics_renamed({TF_STATIC: "/spot/tf_static"})],
    "all of tf at once": [
        mounting_in_hops("chassis_link"),
        footprint_hop("odom", "base_link", "base_footprint"),
        fixed_edges_on_tf(),
        inverted("odom", "base_footprint"),
    ],
}


@pytest.mark.parametrize("habits", SINGLE.values(), ids=SINGLE.keys())
def test_a_habit_alone_changes_no_row(
    rows_of: Callable[..., Rows], plain: Rows, spot: Robot, habits: list[Habit]
) -> None:
    lidar = spot.lidar.model_copy(update={"frame": "velodyne"})
    assert_same_rows(rows_of(habits, spot.model_copy(update={"lidar": lidar})), plain)


def test_clouds_in_the_layout_of_an_ouster_change_no_row(
    rows_of: Callable[..., Rows], plain: Rows, spot: Robot
) -> None:
    assert_same_rows(rows_of([ouster_points("/velodyne_points")], spot), plain)


@pytest.mark.parametrize("layout", [livox_points, livox_messages])
def test_livox_clouds_have_the_same_points(
    rows_of: Callable[..., Rows], plain: Rows, spot: Robot, layout: Callable[[str], Habit]
) -> None:
    lidar = spot.lidar.model_copy(update={"model": "generic"})
    found = rows_of([layout("/velodyne_points")], spot.model_copy(update={"lidar": lidar}))
    assert_same_motion(found, plain)
    assert_same_points(found, plain)


def test_odometry_by_tf_alone_has_the_same_poses_points_and_velocities(
    rows_of: Callable[..., Rows], plain: Rows, spot: Robot
) -> None:
    habits = [
        footprint_hop("odom", "base_link", "base_footprint"),
        inverted("odom", "base_footprint"),
        left_out("/spot/odometry"),
    ]
    topics = spot.topics.model_copy(update={"odometry": "/tf"})
    found = rows_of(habits, spot.model_copy(update={"topics": topics}))
    np.testing.assert_allclose(found["pose"], plain["pose"], rtol=0, atol=MILLIMETRE)
    assert_same_points(found, plain)
    assert np.median(np.abs(found["velocity_history"] - plain["velocity_history"])) < 0.03


def test_a_twist_that_is_never_filled_is_differentiated(
    rows_of: Callable[..., Rows], plain: Rows, spot: Robot
) -> None:
    found = rows_of([twist_never_filled("/spot/odometry")], spot)
    np.testing.assert_allclose(found["pose"], plain["pose"], rtol=0, atol=MILLIMETRE)
    assert np.median(np.abs(found["velocity_history"] - plain["velocity_history"])) < 0.03


@pytest.mark.parametrize("name", sorted(DRIVERS))
def test_a_robots_recording_makes_rows_under_its_manifest(
    rows_of: Callable[..., Rows], plain: Rows, spot: Robot, name: str
) -> None:
    robot = load_manifest(find_manifest("robots", name), Robot)
    if robot.camera.intrinsics != "camera_info":
        sized = robot.camera.intrinsics.model_copy(update={"width": 160, "height": 120})
        camera = robot.camera.model_copy(update={"intrinsics": sized})
        robot = robot.model_copy(update={"camera": camera})
    found = rows_of(habits_of(name, spot), robot, "mcap" if name in ROS_2 else "bag")
    np.testing.assert_array_equal(found["stamp_ns"], plain["stamp_ns"])
    np.testing.assert_allclose(found["pose"][:, :2], plain["pose"][:, :2], atol=MILLIMETRE)
    velocities = found["velocity_history"] - plain["velocity_history"]
    assert np.median(np.abs(velocities)) < 0.03
    assert found["point_count"].min() > 1000
