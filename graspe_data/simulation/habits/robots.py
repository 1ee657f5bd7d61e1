"""The habits of the robots that ship as manifests."""

from __future__ import annotations

import difflib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Final

import numpy as np

from graspe_data.errors import ManifestError
from graspe_data.geometry import Transform, rotation_from_rpy
from graspe_data.manifest import find_manifest, load_manifest
from graspe_data.robot import Robot
from graspe_data.simulation.habits.carried_clouds import clouds_in_odometry_frame
from graspe_data.simulation.habits.clouds import livox_messages, ouster_points, positions_only
from graspe_data.simulation.habits.odometry import twist_in_odometry_frame, twist_never_filled
from graspe_data.simulation.habits.packets import velodyne_packets
from graspe_data.simulation.habits.pictures import raw_pictures
from graspe_data.simulation.habits.recorded import Habit, frames_renamed, left_out, topics_renamed
from graspe_data.simulation.habits.transforms import (
    TF,
    TF_STATIC,
    fixed_edges_on_tf,
    mounting_in_hops,
    second_odometry,
)
from graspe_data.simulation.messages import Messages

VISION: Final = Transform(rotation_from_rpy(0.01, -0.02, 0.7), np.array([3.0, -2.0, 0.4]))
"""Where Spot's odometry frame lies in that of its vision, somewhere."""


@dataclass(frozen=True)
class Names:
    """Topics and frames of the plain recording."""

    image: str
    points: str
    odometry: str
    odometry_frame: str
    base_frame: str
    camera_frame: str
    lidar_frame: str

    @classmethod
    def of(cls, plain: Robot) -> Names:
        """As the simulator writes them for a robot."""
        frames, topics = Messages(plain), plain.topics
        return cls(
            topics.image,
            topics.points,
            topics.odometry,
            frames.odom,
            frames.base,
            frames.camera,
            frames.lidar,
        )


@dataclass(frozen=True)
class Driver:
    """How one robot's drivers write: its sensors' frames, and its habits in the plain names."""

    camera_frame: str
    lidar_frame: str
    habits: Callable[[Names], list[Habit]]
    topics: Mapping[str, str] = field(default_factory=dict)
    """Topics beside those of the manifest that have other names."""


def spot_frames(names: Names) -> list[Habit]:
    """The frames of both drivers; the clouds keep their fields."""
    odom, base = names.odometry_frame, names.base_frame
    return [
        twist_in_odometry_frame(names.odometry),
        clouds_in_odometry_frame(names.points, names.odometry),
        mounting_in_hops("head"),
        fixed_edges_on_tf(latched=True),
        second_odometry(odom, base, "vision", VISION),
    ]


def _spot_ros1(names: Names) -> list[Habit]:
    return [*spot_frames(names), positions_only(names.points), raw_pictures(names.image, "mono8")]


def _spot_ros2(names: Names) -> list[Habit]:
    return [*spot_frames(names), positions_only(names.points), raw_pictures(names.image, "rgb8")]


def _clearpath(names: Names) -> list[Habit]:
    return [mounting_in_hops("chassis_link"), raw_pictures(names.image, "bgr8")]


def _go2(names: Names) -> list[Habit]:
    return [
        twist_never_filled(names.odometry),
        livox_messages(names.points),
        raw_pictures(names.image, "bgr8"),
    ]


def _rellis(names: Names) -> list[Habit]:
    return [
        ouster_points(names.points),
        mounting_in_hops("chassis_link"),
        raw_pictures(names.image, "rgb8"),
    ]


def _tartandrive(names: Names) -> list[Habit]:
    return [raw_pictures(names.image, "bgr8"), left_out(TF_STATIC)]


def _scand_spot(names: Names) -> list[Habit]:
    del names
    return [fixed_edges_on_tf()]


def _scand_jackal(names: Names) -> list[Habit]:
    return [velodyne_packets(names.points), left_out(TF), left_out(TF_STATIC)]


DRIVERS: Final[Mapping[str, Driver]] = {
    "spot_ros1": Driver("frontleft_fisheye", "velodyne", _spot_ros1),
    "spot_ros2": Driver("frontleft_fisheye", "velodyne", _spot_ros2),
    "husky": Driver("camera_optical", "velodyne", _clearpath),
    "jackal": Driver("front_camera", "velodyne", _clearpath),
    "go2_livox": Driver("front_camera", "livox_frame", _go2),
    "rellis_warthog": Driver("pylon_camera", "ouster1/os1_lidar", _rellis),
    "tartandrive_atv": Driver("multisense/left_camera_optical_frame", "velodyne_1", _tartandrive),
    "scand_spot": Driver("camera_optical", "velodyne", _scand_spot),
    "scand_jackal": Driver("camera_rgb_optical_frame", "velodyne", _scand_jackal),
}
"""By the names of the manifests."""


def habits_of(name: str, plain: Robot) -> list[Habit]:
    """The habits of a robot that ships, for the recording of another.

    Args:
        name: Of the robot whose drivers are to write.
        plain: The robot that the simulator records.

    Raises:
        ManifestError: No robot of that name has habits here.
    """
    if name not in DRIVERS:
        nearest = difflib.get_close_matches(name, DRIVERS, n=1, cutoff=0.5)
        advice = f" Did you mean {nearest[0]!r}?" if nearest else ""
        raise ManifestError(
            f"habits: no robot {name!r}; those whose habits are known are "
            f"{', '.join(sorted(DRIVERS))}.{advice}"
        )
    robot, driver = load_manifest(find_manifest("robots", name), Robot), DRIVERS[name]
    names = Names.of(plain)
    return [
        *driver.habits(names),
        frames_renamed(_frames(names, driver, robot)),
        *_only_its_topics(plain, robot),
        topics_renamed({**_topics(plain, robot), **driver.topics}),
    ]


def _frames(names: Names, driver: Driver, robot: Robot) -> dict[str, str]:
    return {
        names.odometry_frame: robot.odometry_frame,
        names.base_frame: robot.base_frame,
        names.camera_frame: driver.camera_frame,
        names.lidar_frame: driver.lidar_frame,
    }


def _topics(plain: Robot, robot: Robot) -> dict[str, str]:
    ours, theirs = dict(plain.topics), dict(robot.topics)
    return {
        topic: theirs[role] for role, topic in ours.items() if topic and theirs[role] is not None
    }


def _only_its_topics(plain: Robot, robot: Robot) -> Sequence[Habit]:
    """Sensors that the robot lacks are not recorded."""
    theirs = dict(robot.topics)
    return [left_out(topic) for role, topic in plain.topics if topic and theirs[role] is None]
