"""Rays of a sensor in motion, against closed forms."""

from __future__ import annotations

import numpy as np
import pytest

from graspe_data.geometry import Transform, rotation_from_rpy
from graspe_data.simulation.lidar.beams import moving_rays

KNOTS = np.sort(np.random.default_rng(0).uniform(0, 4, 200))


def some_rays(count: int = 3) -> np.ndarray:
    rays = np.random.default_rng(1).normal(size=(len(KNOTS), count, 3))
    unit: np.ndarray = rays / np.linalg.norm(rays, axis=2, keepdims=True)
    return unit.astype(np.float32)


def test_a_standing_sensor_turns_and_shifts_all_rays_alike() -> None:
    pose = Transform(rotation_from_rpy(0.1, -0.2, 2.0), np.array([3.0, -1.0, 0.7]))
    rays = some_rays()
    origins, directions = moving_rays(rays, KNOTS, [pose])
    np.testing.assert_allclose(origins, np.tile(pose.translation, (rays.size // 3, 1)), rtol=1e-6)
    np.testing.assert_allclose(directions, rays.reshape(-1, 3) @ pose.rotation.T, atol=1e-6)


def test_origins_follow_a_straight_drive() -> None:
    speed = np.array([0.5, 0.1, -0.02])
    poses = [Transform(np.eye(3), knot * speed) for knot in range(5)]
    rays = some_rays()
    origins, directions = moving_rays(rays, KNOTS, poses)
    np.testing.assert_allclose(origins, np.repeat(KNOTS, 3)[:, None] * speed, atol=1e-6)
    np.testing.assert_allclose(directions, rays.reshape(-1, 3), atol=1e-6)


@pytest.mark.parametrize("rate", [0.002, 0.01])
def test_directions_follow_a_turn_on_the_spot(rate: float) -> None:
    poses = [Transform(rotation_from_rpy(0.0, 0.0, knot * rate), np.zeros(3)) for knot in range(5)]
    rays = some_rays()
    _, directions = moving_rays(rays, KNOTS, poses)
    turns = [rotation_from_rpy(0.0, 0.0, float(knot) * rate) for knot in KNOTS]
    expected = np.einsum("nij,nkj->nki", np.array(turns), rays).reshape(-1, 3)
    np.testing.assert_allclose(directions, expected, atol=rate**2 / 8 + 1e-6)


def test_the_last_pose_also_serves_beams_after_it() -> None:
    poses = [Transform(np.eye(3), np.array([float(knot), 0.0, 0.0])) for knot in range(2)]
    origins, _ = moving_rays(some_rays()[:1], np.array([1.0]), poses)
    np.testing.assert_allclose(origins[:, 0], 1.0)
