"""Robot manifests: those that ship load, and what cannot be a robot is refused."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from graspe_data.errors import ManifestError
from graspe_data.manifest import find_manifest, load_manifest, shipped_manifests, validate
from graspe_data.robot import Intrinsics, Mounting, Robot

SHIPPED = sorted((shipped_manifests() / "robots").glob("*.yaml"))


@pytest.fixture
def spot() -> dict[str, Any]:
    """The content of the shipped manifest, to be changed."""
    content = yaml.safe_load(find_manifest("robots", "spot").read_text())
    assert isinstance(content, dict)
    return content


def refusal(content: dict[str, Any]) -> str:
    with pytest.raises(ManifestError) as caught:
        validate(content, Robot, "my_robot.yaml")
    assert str(caught.value).startswith("my_robot.yaml: not a valid Robot:\n")
    return str(caught.value)


@pytest.mark.parametrize("path", SHIPPED, ids=lambda path: path.stem)
def test_a_shipped_robot_loads_under_its_own_name(path: Path) -> None:
    robot = load_manifest(path, Robot)
    assert robot.name == path.stem
    assert robot.limits.linear_velocity[0] <= 0 < robot.limits.linear_velocity[1]
    assert robot.footprint.length >= robot.footprint.width


def test_the_spot_is_the_one_of_the_paper() -> None:
    robot = load_manifest(find_manifest("robots", "spot"), Robot)
    assert robot.limits.linear_velocity == (0.0, 0.6)
    assert robot.limits.yaw_rate == (-0.6, 0.6)
    assert (robot.lidar.model, robot.lidar.rings) == ("VLP-16", 16)


@pytest.mark.parametrize("limit", ["linear_velocity", "yaw_rate"])
def test_limits_are_ordered(spot: dict[str, Any], limit: str) -> None:
    spot["limits"][limit] = [0.5, -0.5]
    assert f"{limit}: the lower limit 0.5 is above the upper limit -0.5" in refusal(spot)


def test_a_limit_may_be_one_value(spot: dict[str, Any]) -> None:
    spot["limits"]["linear_velocity"] = [0.4, 0.4]
    assert validate(spot, Robot, "").limits.linear_velocity == (0.4, 0.4)


@pytest.mark.parametrize(
    ("first", "second"), [("image", "points"), ("image", "camera_info"), ("odometry", "imu")]
)
def test_one_topic_does_not_serve_in_two_roles(
    spot: dict[str, Any], first: str, second: str
) -> None:
    spot["topics"][first] = spot["topics"][second] = "/twice"
    text = refusal(spot)
    assert "/twice is named as both" in text
    assert first in text
    assert second in text


def test_roles_that_no_topic_has_are_not_the_same_topic(spot: dict[str, Any]) -> None:
    for role in ("camera_info", "command", "imu"):
        spot["topics"][role] = None
    assert validate(spot, Robot, "").topics.imu is None


@pytest.mark.parametrize(
    ("group", "key", "value", "said"),
    [
        ("footprint", "width", 0, "greater than 0"),
        ("limits", "linear_acceleration", -1, "greater than 0"),
        ("limits", "yaw_rate", [1], "Field required"),
        ("lidar", "model", "VLP-64", "'VLP-16', 'VLP-32C', 'Pandar40P'"),
        ("lidar", "rings", 0, "greater than or equal to 1"),
        ("lidar", "minimum_range", -0.1, "greater than or equal to 0"),
        ("topics", "image", None, "valid string"),
        ("recognised_by", "topics", {}, "at least 1 item"),
        ("recognised_by", "topics", {"odom": "nav_msgs/Odometry"}, "match pattern"),
        ("recognised_by", "topics", {"/odom": "Odometry"}, "match pattern"),
        ("recognised_by", "topic", {"/odom": "nav_msgs/Odometry"}, "Did you mean 'topics'?"),
    ],
)
def test_what_no_robot_has_is_refused(
    spot: dict[str, Any], group: str, key: str, value: object, said: str
) -> None:
    spot.setdefault(group, {})[key] = value
    text = refusal(spot)
    assert f"{group}.{key}" in text
    assert said in text


@pytest.mark.parametrize("group", ["topics", "limits", "footprint", "name"])
def test_what_every_robot_has_is_required(spot: dict[str, Any], group: str) -> None:
    del spot[group]
    assert f"{group}: Field required" in refusal(spot)


def test_a_mounting_is_a_transform_into_base_link() -> None:
    mounting = Mounting(translation=(0.4, 0.0, 0.25), rotation_rpy=(0.0, 0.0, np.pi / 2))
    np.testing.assert_allclose(
        mounting.transform.apply(np.array([1.0, 0.0, 0.0])), [0.4, 1.0, 0.25], atol=1e-12
    )


def test_the_camera_matrix() -> None:
    camera = Intrinsics(width=640, height=480, fx=500, fy=510, cx=319.5, cy=239.5)
    np.testing.assert_array_equal(camera.matrix, [[500, 0, 319.5], [0, 510, 239.5], [0, 0, 1]])
