"""A robot that is not the bundle's is refused with every difference named."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from graspe_data.bundle_contract import BundleContract
from graspe_data.calibration import Calibration
from graspe_data.errors import PlannerError
from graspe_data.geometry import Transform, rotation_from_rpy
from graspe_data.robot import Footprint, Intrinsics, Limits, Robot
from planners.bundle import Bundle
from planners.graspe_planner import GraspePlanner
from planners.robot_check import MatchSettings, check_robot
from planners.scorer import Scorer
from tests.planners.conftest import Situations
from tests.planners.tiny_bundle import tiny_contract


@pytest.fixture
def contract(robot: Robot, calibration: Calibration) -> BundleContract:
    return tiny_contract(robot, calibration)


def test_the_robot_itself_matches(
    contract: BundleContract, robot: Robot, calibration: Calibration
) -> None:
    check_robot(contract, robot, calibration)


def test_a_camera_of_another_resolution_matches_by_its_view(
    contract: BundleContract, robot: Robot, calibration: Calibration
) -> None:
    larger = Intrinsics(width=640, height=480, fx=450.0, fy=450.0, cx=319.5, cy=239.5)
    check_robot(contract, robot, replace(calibration, intrinsics=larger))


@pytest.mark.parametrize(
    ("changes", "difference"),
    [
        ({"base_height": 0.7}, "base_height: 0.7 m, expected 0.5 m"),
        ({"footprint": Footprint(length=0.8, width=0.5)}, "footprint length: 0.8 m, expected 1.1"),
        (
            {"limits": Limits(linear_velocity=(0, 1.6), yaw_rate=(-0.6, 0.6))},
            "limits.linear_velocity: 0..1.6, expected within 0..0.6",
        ),
    ],
)
def test_another_body(
    contract: BundleContract,
    robot: Robot,
    calibration: Calibration,
    changes: dict[str, Any],
    difference: str,
) -> None:
    with pytest.raises(PlannerError, match=difference):
        check_robot(contract, robot.model_copy(update=changes), calibration)


def test_a_calibration_that_is_no_number_matches_nothing(
    contract: BundleContract, robot: Robot, calibration: Calibration
) -> None:
    nowhere = Transform(np.full((3, 3), np.nan), np.full(3, np.nan))
    lost = replace(calibration, base_from_camera=nowhere, base_from_lidar=nowhere)
    for name in ("camera", "lidar"):
        with pytest.raises(PlannerError, match=rf"{name} mounting: at \(nan, nan, nan\) m"):
            check_robot(contract, robot, lost)


def test_a_slower_robot_matches(
    contract: BundleContract, robot: Robot, calibration: Calibration
) -> None:
    slower = Limits(linear_velocity=(0, 0.3), yaw_rate=(-0.2, 0.2))
    check_robot(contract, robot.model_copy(update={"limits": slower}), calibration)


def test_all_differences_of_the_sensors_are_named(
    contract: BundleContract, robot: Robot, calibration: Calibration
) -> None:
    turned = calibration.base_from_camera.rotation @ rotation_from_rpy(0, 0.2, 0)
    other = Calibration(
        Intrinsics(width=64, height=48, fx=80.0, fy=45.0, cx=31.5, cy=23.5),
        Transform(turned, calibration.base_from_camera.translation),
        Transform(np.eye(3), np.array([0.0, 0.0, 0.5])),
    )
    with pytest.raises(PlannerError) as refusal:
        check_robot(contract, robot, other)
    text = str(refusal.value)
    assert "camera fx: 40.0 pixels, expected 22.5" in text
    assert "camera mounting: turned by 0.200 rad" in text
    assert "lidar mounting: at (0.000, 0.000, 0.500) m, expected (0.000, 0.000, 0.300) m" in text
    assert len(text.splitlines()) == 5


def test_what_the_dataset_does_not_tell_is_not_compared(
    contract: BundleContract, robot: Robot, calibration: Calibration
) -> None:
    silent = contract.robot.model_copy(
        update={"camera": None, "base_from_camera": None, "base_from_lidar": None}
    )
    other = replace(calibration, base_from_lidar=Transform(np.eye(3), np.ones(3)))
    check_robot(contract.model_copy(update={"robot": silent}), robot, other)


@pytest.mark.parametrize(
    ("changes", "difference"),
    [
        ({"rings": 32}, "lidar.rings: 32, expected 16"),
        ({"minimum_range": 0.0}, "lidar.minimum_range: 0 m, expected 0.45 m"),
    ],
)
def test_another_lidar(
    contract: BundleContract,
    robot: Robot,
    calibration: Calibration,
    changes: dict[str, Any],
    difference: str,
) -> None:
    other = robot.model_copy(update={"lidar": robot.lidar.model_copy(update=changes)})
    with pytest.raises(PlannerError, match=difference):
        check_robot(contract, other, calibration)


def test_frames_are_compared_where_both_tell(
    contract: BundleContract, robot: Robot, calibration: Calibration
) -> None:
    described = contract.robot.model_copy(
        update={"lidar_frame": "velodyne", "camera_frame": "optical"}
    )
    bundles = contract.model_copy(update={"robot": described})
    check_robot(bundles, robot, calibration)
    check_robot(bundles, robot, replace(calibration, lidar_frame="/velodyne"))
    with pytest.raises(PlannerError, match="lidar_frame: ouster, expected velodyne"):
        check_robot(bundles, robot, replace(calibration, lidar_frame="ouster"))


@pytest.mark.parametrize("sensor", ["base_from_camera", "base_from_lidar", "intrinsics"])
def test_a_scorer_begins_with_its_sensors(
    bundle: Bundle, calibration: Calibration, sensor: str
) -> None:
    moved = Transform(np.eye(3), np.array([0.0, 0.0, 1.0]))
    wide = Intrinsics(width=64, height=48, fx=20.0, fy=20.0, cx=31.5, cy=23.5)
    changes: dict[str, Any] = {sensor: wide if sensor == "intrinsics" else moved}
    other = replace(calibration, **changes)
    with pytest.raises(PlannerError, match="the calibration does not match the bundle tiny"):
        Scorer(bundle, other)
    Scorer(bundle, other, match=MatchSettings(pixels=100, metres=10, radians=10))


@pytest.mark.parametrize(
    "changes",
    [
        {"base_height": 0.7},
        {"footprint": Footprint(length=0.8, width=0.5)},
        {"limits": Limits(linear_velocity=(0, 1.6), yaw_rate=(-0.6, 0.6))},
    ],
)
def test_a_planner_begins_with_its_robot(
    bundle: Bundle, robot: Robot, calibration: Calibration, changes: dict[str, Any]
) -> None:
    scorer = Scorer(bundle, calibration)
    with pytest.raises(PlannerError, match="robot spot does not match the bundle tiny"):
        GraspePlanner(robot.model_copy(update=changes), scorer)


def test_a_frame_that_only_the_bundle_knows_is_the_expected_one(
    bundle: Bundle, calibration: Calibration, situation: Situations
) -> None:
    described = bundle.contract.robot.model_copy(update={"lidar_frame": "velodyne"})
    contract = bundle.contract.model_copy(update={"robot": described})
    scorer = Scorer(replace(bundle, contract=contract), calibration)
    with pytest.raises(PlannerError, match="in the frame 'lidar', expected 'velodyne'"):
        scorer.scene(situation())
