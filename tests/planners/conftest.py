"""A robot, its calibration, what its sensors give, and small bundles for it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from graspe_data.calibration import Calibration
from graspe_data.geometry import Transform, rotation_from_rpy
from graspe_data.manifest import find_manifest, load_manifest
from graspe_data.robot import Intrinsics, Robot
from graspe_data.sensor_data import Motion, Picture, PointCloud
from planners.bundle import Bundle, load_bundle
from planners.situation import Situation
from tests.planners.tiny_bundle import tiny_contract, write_tiny_bundle

NOW = 10_000_000_000
OPTICAL = np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])

Situations = Callable[..., Situation]


@dataclass(frozen=True)
class Robots:
    """All that planners are made of."""

    robot: Robot
    calibration: Calibration
    bundle: Bundle

    @property
    def lidar(self) -> Transform:
        """The lidar's mounting."""
        return self.calibration.base_from_lidar


@pytest.fixture(scope="session")
def robot() -> Robot:
    return load_manifest(find_manifest("robots", "spot"), Robot)


@pytest.fixture(scope="session")
def calibration() -> Calibration:
    """A camera 0.4 m ahead that looks down a little, and a lidar above base_link."""
    intrinsics = Intrinsics(width=64, height=48, fx=45.0, fy=45.0, cx=31.5, cy=23.5)
    camera = Transform(rotation_from_rpy(0, 0.25, 0) @ OPTICAL, np.array([0.4, 0.0, 0.2]))
    return Calibration(intrinsics, camera, Transform(np.eye(3), np.array([0.0, 0.0, 0.3])))


@pytest.fixture(scope="session")
def bundle_path(
    tmp_path_factory: pytest.TempPathFactory, robot: Robot, calibration: Calibration
) -> Path:
    folder = tmp_path_factory.mktemp("bundles") / "tiny"
    return write_tiny_bundle(folder, tiny_contract(robot, calibration))


@pytest.fixture(scope="session")
def bundle(bundle_path: Path) -> Bundle:
    return load_bundle(bundle_path, threads=1)


@pytest.fixture(scope="session")
def robots(robot: Robot, calibration: Calibration, bundle: Bundle) -> Robots:
    return Robots(robot, calibration, bundle)


@pytest.fixture(scope="session")
def scene_bundle(
    tmp_path_factory: pytest.TempPathFactory, robot: Robot, calibration: Calibration
) -> Bundle:
    """A model that does not look at candidates."""
    contract = tiny_contract(robot, calibration, uses_candidates=False)
    folder = write_tiny_bundle(tmp_path_factory.mktemp("bundles") / "scene", contract)
    return load_bundle(folder, threads=1)


@pytest.fixture
def situation() -> Situations:
    """A robot that has driven straight on; posts stand where the test says, in base_link."""

    def make(
        *,
        grey: int = 200,
        posts: tuple[tuple[float, float], ...] = (),
        velocity: tuple[float, float] = (0.3, 0.0),
        goal: tuple[float, float] = (8.0, 0.0),
        pose: tuple[float, float, float] = (0.0, 0.0, 0.0),
    ) -> Situation:
        return Situation(
            now_ns=NOW,
            pose=pose,
            velocity=velocity,
            goal=goal,
            picture=Picture(NOW - 50_000_000, "camera", np.full((48, 64, 3), grey, np.uint8)),
            cloud=cloud_of(posts),
            motions=motions_until(NOW, velocity),
        )

    return make


def motions_until(last_ns: int, velocity: tuple[float, float]) -> tuple[Motion, ...]:
    """Odometry at 20 Hz over 4 s of a robot that drove straight on and is at the origin."""
    stamps = last_ns - np.arange(80, -1, -1) * 50_000_000
    return tuple(
        Motion(
            stamp,
            "odom",
            "base_link",
            (velocity[0] * (stamp - last_ns) / 1e9, 0.0, 0.0),
            (0.0, 0.0, 0.0, 1.0),
            *velocity,
        )
        for stamp in stamps.tolist()
    )


def cloud_of(posts: tuple[tuple[float, float], ...]) -> PointCloud:
    """Flat ground on two rings, and posts on a third, as a lidar 0.8 m above the ground sees."""
    angle = np.linspace(-1.5, 1.5, 150)
    rings = [np.stack((r * np.cos(angle), r * np.sin(angle), 0 * angle - 0.8), 1) for r in (3, 5)]
    around = np.linspace(0, 2 * np.pi, 24)
    rows = [(x + 0.1 * np.cos(around), y + 0.1 * np.sin(around), 0 * around) for x, y in posts]
    standing = [np.stack(row, axis=1) for row in rows]
    groups = [*rings, *([np.concatenate(standing)] if standing else [])]
    ring = np.repeat(np.arange(len(groups)), [len(group) for group in groups]).astype(np.int32)
    xyz = np.concatenate(groups).astype(np.float32)
    return PointCloud(NOW - 80_000_000, "lidar", xyz, None, ring)
