"""A recording of every kind of disagreement, and what its robot's manifest says besides."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np

from tests.graspe_data.recordings.decoding.lidars.test_hesai import packet as hesai_packet
from tests.graspe_data.recordings.decoding.lidars.test_hesai import turning
from tests.made_recordings import (
    CLOUD,
    COMMAND,
    IMAGE,
    INFO,
    MOUNTINGS,
    ODOMETRY,
    OPTICAL,
    SECOND,
    START,
    STATIC,
    STRAIGHT,
    TF,
    TYPES,
    Drive,
    Entry,
    MadeRecording,
    Pose,
    calibration,
    cloud,
    header,
    odometry,
    room,
    time_of,
    transforms,
    turned,
    twist,
)

LOOKING_AHEAD = [-1.5707963, 0.0, -1.5707963]
ROBOT: dict[str, Any] = {
    "name": "made",
    "topics": {
        "image": IMAGE,
        "points": CLOUD,
        "odometry": ODOMETRY,
        "camera_info": INFO,
        "command": COMMAND,
    },
    "base_height": 0.5,
    "lidar": {"rings": 16},
    "limits": {"linear_velocity": [0, 2], "yaw_rate": [-1, 1]},
    "footprint": {"length": 1.0, "width": 0.6},
}


class Case(NamedTuple):
    """A recording of one kind, and what its robot's manifest says besides."""

    made: Callable[[], MadeRecording]
    robot: Mapping[str, Any] = MappingProxyType({})


def by_pose(change: Callable[[int, Pose, Drive], Any], drive: Drive | None = None) -> MadeRecording:
    """A recording whose odometry is written anew from the true pose at each stamp."""
    made = MadeRecording(drive or Drive())
    return made.changed(
        ODOMETRY, lambda message: change(time_of(message), made.pose(time_of(message)), made.drive)
    )


def in_fixed_frame(time_ns: int, pose: Pose, drive: Drive) -> Any:
    linear = (drive.v * math.cos(pose.yaw), drive.v * math.sin(pose.yaw))
    return odometry(time_ns, pose, linear, drive.omega)


def resetting(time_ns: int, pose: Pose, drive: Drive) -> Any:
    late = time_ns >= START + 6 * SECOND
    moved = Pose(pose.x - 3.0, pose.y, pose.yaw) if late else pose
    return odometry(time_ns, moved, (drive.v, 0.0), drive.omega)


def spiking(time_ns: int, pose: Pose, drive: Drive) -> Any:
    v = 9.0 if time_ns == START + 6 * SECOND else drive.v
    return odometry(time_ns, pose, (v, 0.0), drive.omega)


def stopping(time_ns: int, pose: Pose, drive: Drive) -> Any:
    stands = 5 * SECOND <= time_ns - START < 8 * SECOND
    return odometry(time_ns, pose, (0.0 if stands else drive.v, 0.0), 0.0 if stands else 0.2)


def slipping(time_ns: int, pose: Pose, drive: Drive) -> Any:
    seconds = (time_ns - START) / SECOND
    slips = 5 <= seconds < 7
    v = 1.6 + 0.1 * math.sin(5 * seconds) if slips else drive.v
    return odometry(time_ns, pose, (v, 0.0), drive.omega)


def with_spikes(time_ns: int, pose: Pose, drive: Drive) -> Any:
    lost = (time_ns - START) // (SECOND // 50) in (200, 300, 400)
    moved = Pose(pose.x + 5.0, pose.y, pose.yaw) if lost else pose
    return odometry(time_ns, moved, (drive.v, 0.0), drive.omega)


def to_and_fro(time_ns: int, pose: Pose, drive: Drive) -> Any:
    aside = 0.02 * (-1) ** ((time_ns - START) // (SECOND // 50))
    return odometry(time_ns, Pose(pose.x, pose.y + aside, pose.yaw), (drive.v, 0.0), drive.omega)


def without_heading(time_ns: int, pose: Pose, _: Drive) -> Any:
    return odometry(time_ns, Pose(pose.x, pose.y, 0.0), (0.0, 0.0), 0.0)


def in_a_camera_frame(time_ns: int, pose: Pose, drive: Drive) -> Any:
    """The body itself, told in a frame whose z points ahead and whose y points down."""
    message = odometry(time_ns, pose, (drive.v, 0.0), drive.omega)
    half = math.sqrt(0.5) * math.cos(pose.yaw / 2 + math.pi / 4)
    other = math.sqrt(0.5) * math.sin(pose.yaw / 2 + math.pi / 4)
    place = message.pose.pose.position
    place.x, place.y, place.z = -pose.y, 0.0, pose.x
    turn = message.pose.pose.orientation
    turn.x, turn.y, turn.z, turn.w = half, -other, other, half
    return message


def poses_only() -> MadeRecording:
    made = MadeRecording()

    def posed(message: Any) -> Any:
        return TYPES["geometry_msgs/msg/PoseStamped"](message.header, message.pose.pose)

    return made.changed(ODOMETRY, posed)


def twists_only() -> MadeRecording:
    def moving(message: Any) -> Any:
        return TYPES["geometry_msgs/msg/TwistStamped"](message.header, message.twist.twist)

    return MadeRecording().changed(ODOMETRY, moving)


def clouds_in_odometry_frame() -> MadeRecording:
    made = MadeRecording()

    def carried(message: Any) -> Any:
        pose, points = made.pose(time_of(message)), room()
        x, y = points["x"] + 0.2, points["y"].copy()
        cosine, sine = math.cos(pose.yaw), math.sin(pose.yaw)
        points["x"], points["y"] = cosine * x - sine * y + pose.x, sine * x + cosine * y + pose.y
        points["z"] += 0.4
        return cloud(time_of(message), points, "odom")

    return made.changed(CLOUD, carried)


def mounted_anew() -> MadeRecording:
    moved = ("base_link", "lidar", (0.2, 0.0, 0.9), STRAIGHT)
    at_ns = START + 6 * SECOND
    return MadeRecording().plus([(STATIC, transforms(at_ns, [moved]), at_ns)])


def of_another_frame() -> MadeRecording:
    edge = ("base_link", "imu_link", (-0.5, 0.0, 0.2), STRAIGHT)
    made = MadeRecording(mountings=(*MOUNTINGS, edge))
    return made.changed(ODOMETRY, lambda message: replace(message, child_frame_id="imu_link"))


def begun_again() -> MadeRecording:
    first, second = MadeRecording(), MadeRecording(Drive(v=1.2, omega=0.0))
    later = [(t, m, at_ns + 15 * SECOND) for t, m, at_ns in second.entries]
    return first.plus(later)


def behind(seconds: float) -> MadeRecording:
    """A lidar whose clock is behind the camera's."""

    def shifted(message: Any) -> Any:
        at_ns = time_of(message) - round(seconds * SECOND)
        return replace(message, header=header(at_ns, "lidar"))

    return MadeRecording().changed(CLOUD, shifted)


def standing() -> MadeRecording:
    return MadeRecording(Drive(v=0.0, omega=0.0))


def without_use() -> MadeRecording:
    none = ("base_link", "gripper", (1.0, 0.0, 0.0), (0.0, 0.0, 0.0, 0.0))
    return MadeRecording(mountings=(none, *MOUNTINGS))


def moving_edge(made: MadeRecording, aside: float = 0.0, late_ns: int = 0) -> Iterator[Entry]:
    for time_ns in made.times(50):
        pose, at_ns = made.pose(time_ns), time_ns + late_ns
        turn = turned(pose.yaw)
        quaternion = (turn.x, turn.y, turn.z, turn.w)
        edge = ("odom", "base_link", (pose.x + aside, pose.y, 0.0), quaternion)
        yield TF, transforms(at_ns, [edge]), at_ns + 3_000_000


def published_twice() -> MadeRecording:
    other = ("base_link", "lidar", (0.2, 0.0, 0.6), STRAIGHT)
    made = MadeRecording()
    again = [(TF, transforms(t, [other]), t + 1_000_000) for t in made.times(10)]
    return made.plus(again)


def of_two_publishers() -> MadeRecording:
    made = MadeRecording().without(ODOMETRY)
    return made.plus([*moving_edge(made), *moving_edge(made, 0.1, 7_000_000)])


def orphaned() -> MadeRecording:
    mast = ("base_link", "mast", (0.0, 0.0, 1.0), STRAIGHT)
    other = ("mast", "lidar", (0.2, 0.0, -0.6), STRAIGHT)
    return MadeRecording(mountings=(mast, other, *MOUNTINGS))


def tf_on_another_clock() -> MadeRecording:
    made = MadeRecording()
    late = [(t, m, at_ns + 30 * SECOND) for t, m, at_ns in moving_edge(made)]
    early = [(t, m, at_ns - 30 * SECOND) for t, m, at_ns in late]
    for _, message, _ in early:
        for edge in message.transforms:
            edge.header.stamp.sec -= 100
    return made.plus(early)


def lacking_a_lidar() -> MadeRecording:
    second = MadeRecording(Drive(v=1.2, omega=0.0)).without(CLOUD)
    later = [(t, m, at_ns + 15 * SECOND) for t, m, at_ns in second.entries]
    return MadeRecording().plus(later)


def turning_camera() -> MadeRecording:
    made = MadeRecording(mountings=MOUNTINGS[:1])
    edges = []
    for number, time_ns in enumerate(made.times(20)):
        turn = turned(0.01 * number)
        edge = ("base_link", "cam", (0.3, 0.0, 0.3), (turn.x, turn.y, turn.z, turn.w))
        edges.append((TF, transforms(time_ns, [edge]), time_ns))
    return made.plus(edges)


def differing_cameras(**changes: Any) -> Callable[[], MadeRecording]:
    def change(message: Any) -> Any:
        return calibration(time_of(message), **changes)

    return lambda: MadeRecording().changed(INFO, change)


def named_after_another() -> MadeRecording:
    made = MadeRecording()
    other = [("/rear/camera_info", m, at_ns) for t, m, at_ns in made.entries if t == INFO]
    return made.without(INFO).plus(other)


def in_a_body_frame() -> MadeRecording:
    body = ("base_link", "cam", (0.3, 0.0, 0.3), STRAIGHT)
    optical = ("cam", "cam_optical", (0.0, 0.0, 0.0), OPTICAL)
    return MadeRecording(mountings=(MOUNTINGS[0], body, optical))


def of_packets() -> MadeRecording:
    data = np.frombuffer(hesai_packet("PandarXT32", 1000, turning("PandarXT32")), np.uint8)
    packed = np.concatenate([data, np.zeros(1500 - data.size, np.uint8)])

    def scanned(message: Any) -> Any:
        stamped = message.header.stamp
        packet = TYPES["pandar_msgs/msg/PandarPacket"](stamped, packed, data.size)
        return TYPES["pandar_msgs/msg/PandarScan"](header(time_of(message), "lidar"), [packet])

    return MadeRecording().changed(CLOUD, scanned)


def commanded(v: float) -> Callable[[], MadeRecording]:
    return lambda: MadeRecording().changed(COMMAND, lambda _: twist((v, 0.0), 0.0))


def unfilled() -> MadeRecording:
    zero = Pose(0.0, 0.0, 0.0)
    return by_pose(lambda time_ns, *_: odometry(time_ns, zero, (0.0, 0.0), 0.0))


CASES: dict[str, Case] = {
    "motion_agrees": Case(MadeRecording),
    "commands_agree": Case(MadeRecording),
    "twist_in_fixed_frame": Case(lambda: by_pose(in_fixed_frame)),
    "twist_never_filled": Case(
        lambda: by_pose(lambda time_ns, pose, _: odometry(time_ns, pose, (0.0, 0.0), 0.0))
    ),
    "yaw_rate_never_filled": Case(
        lambda: by_pose(lambda time_ns, pose, drive: odometry(time_ns, pose, (drive.v, 0.0), 0.0))
    ),
    "poses_never_filled": Case(
        lambda: by_pose(
            lambda time_ns, _, drive: odometry(time_ns, Pose(0, 0, 0), (drive.v, 0.0), drive.omega)
        )
    ),
    "twist_stops": Case(lambda: by_pose(stopping)),
    "motion_differs_at_times": Case(lambda: by_pose(slipping)),
    "pose_spikes": Case(lambda: by_pose(with_spikes)),
    "poses_scatter": Case(lambda: by_pose(to_and_fro)),
    "odometry_frame_not_level": Case(lambda: by_pose(in_a_camera_frame)),
    "drives_backwards": Case(lambda: MadeRecording(Drive(v=-0.6))),
    "commands_opposite": Case(commanded(-0.6)),
    "moves_sideways": Case(
        lambda: by_pose(without_heading, Drive(heading=1.2)),
    ),
    "heading_never_filled": Case(lambda: by_pose(without_heading, Drive(omega=0.08, heading=0.0))),
    "no_twist": Case(poses_only),
    "no_poses": Case(twists_only),
    "pose_jumps": Case(lambda: by_pose(resetting)),
    "beyond_limits": Case(lambda: by_pose(spiking)),
    "cloud_in_other_frame": Case(
        clouds_in_odometry_frame, {"lidar": {"rings": 16, "frame": "lidar"}}
    ),
    "mounting_changed": Case(mounted_anew),
    "odometry_carried_to_base": Case(of_another_frame),
    "stamps_begin_again": Case(begun_again),
    "camera_size": Case(differing_cameras(size=(128, 96))),
    "camera_frame": Case(differing_cameras(frame="camera_rgb")),
    "camera_name": Case(
        named_after_another, {"topics": {**ROBOT["topics"], "camera_info": "/rear/camera_info"}}
    ),
    "optical_frame": Case(in_a_body_frame),
    "lidar_packets": Case(of_packets, {"lidar": {"model": "PandarXT32"}}),
    "odometry_by_lidar": Case(
        lambda: MadeRecording().without(ODOMETRY, COMMAND),
        {"odometry": "lidar", "topics": {"image": IMAGE, "points": CLOUD, "camera_info": INFO}},
    ),
    "sensor_late": Case(lambda: behind(0.9655)),
    "offset_measured": Case(
        lambda: behind(0.9655), {"clocks": {"points": {"offset_s": "measured"}}}
    ),
    "commands_differ": Case(commanded(2.0)),
    "little_motion": Case(standing),
    "velocity_forced": Case(MadeRecording, {"odometry_velocity": "differentiated"}),
    "edge_unusable": Case(without_use),
    "edge_published_twice": Case(published_twice),
    "two_parents": Case(orphaned),
    "edge_on_other_clock": Case(tf_on_another_clock),
    "mounting_differs": Case(
        MadeRecording, {"lidar": {"rings": 16, "mounting": {"translation": [0.2, 0, 1.4]}}}
    ),
    "odometry_of_other_frame": Case(
        MadeRecording,
        {
            "base_frame": "body",
            "camera": {"mounting": {"translation": [0.3, 0, 0.3], "rotation_rpy": LOOKING_AHEAD}},
            "lidar": {"rings": 16, "mounting": {"translation": [0.2, 0, 0.4]}},
        },
    ),
    "stretch_without_rows": Case(lacking_a_lidar),
    "motion_contradicts": Case(
        lambda: by_pose(
            lambda time_ns, pose, drive: odometry(time_ns, pose, (3.6 * drive.v, 0.0), drive.omega)
        )
    ),
    "two_publishers": Case(of_two_publishers, {"topics": {**ROBOT["topics"], "odometry": TF}}),
    "limits_too_low": Case(
        lambda: MadeRecording(Drive(v=2.5)),
        {"limits": {"linear_velocity": [0, 1], "yaw_rate": [-1, 1]}},
    ),
    "never_filled": Case(unfilled),
    "clocks_differ": Case(lambda: behind(170.0)),
    "camera_moves": Case(turning_camera),
    "no_mounting": Case(lambda: MadeRecording(mountings=MOUNTINGS[1:])),
}
