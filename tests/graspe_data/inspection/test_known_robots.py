"""Each robot's own recording suggests that robot first; an unrelated one suggests none."""

from __future__ import annotations

import pytest

from graspe_data.inspection.known_robots import suggest
from graspe_data.manifest import find_manifest, load_manifest, shipped_manifests
from graspe_data.robot import Robot

SHIPPED = sorted(path.stem for path in (shipped_manifests() / "robots").glob("*.yaml"))
SPOT_ROS1 = {
    "/spot/camera/frontleft/image": "sensor_msgs/Image",
    "/spot/camera/frontleft/camera_info": "sensor_msgs/CameraInfo",
    "/spot/camera/back/image": "sensor_msgs/Image",
    "/spot/depth/frontleft/image": "sensor_msgs/Image",
    "/spot/lidar/points": "sensor_msgs/PointCloud2",
    "/spot/odometry": "nav_msgs/Odometry",
    "/spot/odometry/twist": "geometry_msgs/TwistWithCovarianceStamped",
    "/spot/status/feet": "spot_msgs/FootStateArray",
    "/joint_states": "sensor_msgs/JointState",
    "/tf": "tf2_msgs/TFMessage",
    "/tf_static": "tf2_msgs/TFMessage",
}
SPOT_FRAMES = ["body", "odom", "vision", "frontleft_fisheye", "head"]
RELLIS = {
    "/pylon_camera_node/camera_info": "sensor_msgs/CameraInfo",
    "/pylon_camera_node/image_raw": "sensor_msgs/Image",
    "/nerian/left/image_raw": "sensor_msgs/Image",
    "/os1_cloud_node/points": "sensor_msgs/PointCloud2",
    "/velodyne_points": "sensor_msgs/PointCloud2",
    "/odometry/filtered": "nav_msgs/Odometry",
    "/vectornav/IMU": "sensor_msgs/Imu",
    "/vectornav/Odom": "nav_msgs/Odometry",
    "/warthog_velocity_controller/cmd_vel": "geometry_msgs/Twist",
    "/warthog_velocity_controller/odom": "nav_msgs/Odometry",
    "/imu/data": "sensor_msgs/Imu",
}
SCAND_JACKAL = {
    "/camera/rgb/image_raw/compressed": "sensor_msgs/CompressedImage",
    "/camera/depth/image_raw/compressed": "sensor_msgs/CompressedImage",
    "/velodyne_packets": "velodyne_msgs/VelodyneScan",
    "/velodyne_2dscan": "sensor_msgs/LaserScan",
    "/velodyne_2dscan_high_beams": "sensor_msgs/LaserScan",
    "/jackal_velocity_controller/odom": "nav_msgs/Odometry",
    "/imu/data_raw": "sensor_msgs/Imu",
    "/navsat/fix": "sensor_msgs/NavSatFix",
    "/localization": "amrl_msgs/Localization2DMsg",
}


def own(name: str) -> tuple[dict[str, str], tuple[str, ...]]:
    """What a robot's manifest says of itself."""
    robot = load_manifest(find_manifest("robots", name), Robot)
    if robot.recognised_by is None:
        return {topic: "std_msgs/String" for _, topic in robot.topics if topic}, ()
    return dict(robot.recognised_by.topics), robot.recognised_by.frames


@pytest.mark.parametrize("name", SHIPPED)
def test_a_robots_own_topics_suggest_it_first(name: str) -> None:
    assert suggest(*own(name))[0] == (name, 1.0)


@pytest.mark.parametrize("name", SHIPPED)
def test_a_namespace_makes_no_difference(name: str) -> None:
    topics, frames = own(name)
    spaced = {f"/robot7{topic}": kind for topic, kind in topics.items()}
    assert suggest(spaced, [f"robot7/{frame}" for frame in frames])[0] == (name, 1.0)


@pytest.mark.parametrize("name", SHIPPED)
def test_types_count_however_they_are_spelt(name: str) -> None:
    topics, frames = own(name)
    spelt = {topic: kind.replace("/", "/msg/") for topic, kind in topics.items()}
    assert suggest(spelt, frames)[0] == (name, 1.0)


@pytest.mark.parametrize(
    ("topics", "frames", "name"),
    [
        (SPOT_ROS1, SPOT_FRAMES, "spot_ros1"),
        (RELLIS, ["odom", "base_link", "ouster1/os1_lidar"], "rellis_warthog"),
        (SCAND_JACKAL, [], "scand_jackal"),
    ],
)
def test_a_published_list_of_topics_suggests_its_robot(
    topics: dict[str, str], frames: list[str], name: str
) -> None:
    (first, share), *others = suggest(topics, frames)
    assert (first, share) == (name, 1.0)
    assert all(other < 1.0 for _, other in others)


def test_a_recording_that_lacks_a_sensor_is_still_known() -> None:
    fewer = {name: kind for name, kind in SPOT_ROS1.items() if name != "/spot/lidar/points"}
    assert ("spot_ros1", 0.75) in suggest(fewer, SPOT_FRAMES)


@pytest.mark.parametrize("name", ["husky", "jackal"])
def test_a_controllers_own_name_and_a_lidar_are_enough(name: str) -> None:
    topics = {
        f"/{name}_velocity_controller/odom": "nav_msgs/Odometry",
        "/velodyne_points": "sensor_msgs/PointCloud2",
        "/imu/data": "sensor_msgs/Imu",
        "/usb_cam/image_raw": "sensor_msgs/Image",
    }
    ((suggested, share),) = suggest(topics, ["odom", "base_link"])
    assert suggested == name
    assert share == pytest.approx(2 / 3)


def test_a_frame_that_a_robot_always_has_and_that_is_missing_rules_it_out() -> None:
    frames = [frame for frame in SPOT_FRAMES if frame != "body"]
    assert suggest(SPOT_ROS1, frames) == []


UNRELATED = {
    "empty": {},
    "turtle": {"/turtle1/pose": "turtlesim/Pose", "/tf": "tf2_msgs/TFMessage"},
    "indoor": {"/scan": "sensor_msgs/LaserScan", "/odom": "nav_msgs/Odometry"},
    "plain names": {
        "/camera/image_raw": "sensor_msgs/Image",
        "/points": "sensor_msgs/PointCloud2",
        "/odom": "nav_msgs/Odometry",
    },
    "a velodyne": {
        "/velodyne_points": "sensor_msgs/PointCloud2",
        "/odometry/filtered": "nav_msgs/Odometry",
    },
    "other types": dict.fromkeys(SPOT_ROS1, "std_msgs/String"),
}


@pytest.mark.parametrize("topics", UNRELATED.values(), ids=UNRELATED.keys())
def test_an_unrelated_recording_suggests_none(topics: dict[str, str]) -> None:
    assert suggest(topics, []) == []
