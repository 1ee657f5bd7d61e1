"""The robots that ship: every one has habits, and writes the topics by which it is recognised."""

from __future__ import annotations

import pytest

from graspe_data.errors import ManifestError
from graspe_data.inspection.known_robots import suggest
from graspe_data.manifest import find_manifest, load_manifest, shipped_manifests
from graspe_data.robot import Robot
from graspe_data.simulation.habits.message_parts import edges_of
from graspe_data.simulation.habits.recorded import Recorded, with_habits
from graspe_data.simulation.habits.robots import DRIVERS, habits_of
from graspe_data.simulation.motion.drivers import Leg
from tests.conftest import GardenDrive
from tests.graspe_data.simulation.habits.conftest import on

SHIPPED = {path.stem for path in (shipped_manifests() / "robots").glob("*.yaml")}
OWN = {"spot", "kitti_car"}
"""The simulator's own robot, and a data set's."""


@pytest.fixture(scope="module")
def robot(garden_drive: GardenDrive) -> Robot:
    return garden_drive((Leg(0.4, 0.6, 0.0),)).robot


def test_every_robot_that_ships_has_habits() -> None:
    assert set(DRIVERS) == SHIPPED - OWN


@pytest.mark.parametrize("name", sorted(DRIVERS))
def test_a_robots_recording_has_the_topics_of_its_manifest(
    plain: list[Recorded], robot: Robot, name: str
) -> None:
    stream = list(with_habits(plain, habits_of(name, robot)))
    kinds = {message.topic: str(message.content.__msgtype__) for message in stream}
    shipped = load_manifest(find_manifest("robots", name), Robot)
    assert {topic for _, topic in shipped.topics if topic} <= kinds.keys() | {None}
    assert shipped.recognised_by is not None
    mine = shipped.recognised_by.topics
    right = [t for t, kind in mine.items() if _written(t, kind, kinds)]
    wrong = [t for t, kind in mine.items() if _written(t, "", kinds) and t not in right]
    assert len(right) >= 2
    assert wrong == []


def _written(topic: str, kind: str, kinds: dict[str, str]) -> bool:
    return any(
        name.endswith(topic) and kinds[name].replace("/msg/", "/").endswith(kind) for name in kinds
    )


@pytest.mark.parametrize("name", sorted(DRIVERS))
def test_a_robots_recording_names_its_frames(
    plain: list[Recorded], robot: Robot, name: str
) -> None:
    stream = list(with_habits(plain, habits_of(name, robot)))
    shipped = load_manifest(find_manifest("robots", name), Robot)
    odometry = on(stream, shipped.topics.odometry)[0]
    assert odometry.header.frame_id == shipped.odometry_frame
    assert odometry.child_frame_id == shipped.base_frame
    picture = on(stream, shipped.topics.image)[0]
    assert picture.header.frame_id == DRIVERS[name].camera_frame


def test_spot_publishes_one_odometry_frame_as_parent_and_one_as_child(
    plain: list[Recorded], robot: Robot
) -> None:
    stream = list(with_habits(plain, habits_of("spot_ros1", robot)))
    edges = {(edge.parent, edge.child) for m in on(stream, "/tf") for edge in edges_of(m)}
    assert edges >= {("odom", "body"), ("body", "vision"), ("body", "head")}
    cloud = on(stream, "/spot/lidar/points")[0]
    assert (cloud.header.frame_id, cloud.point_step) == ("odom", 12)


@pytest.mark.parametrize("name", ["spot_ros1", "spot_ros2", "go2_livox"])
def test_what_a_robot_writes_suggests_it(plain: list[Recorded], robot: Robot, name: str) -> None:
    stream = list(with_habits(plain, habits_of(name, robot)))
    topics = {message.topic: str(message.content.__msgtype__) for message in stream}
    assert suggest(topics, [])[0] == (name, 1.0)


@pytest.mark.parametrize(
    ("name", "said"), [("spot_ros", "Did you mean 'spot_ros[12]'"), ("spot", "no robot 'spot'")]
)
def test_a_robot_without_habits_is_refused(robot: Robot, name: str, said: str) -> None:
    with pytest.raises(ManifestError, match=said):
        habits_of(name, robot)
