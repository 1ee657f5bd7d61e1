from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from graspe_data.observation.laser_scan import LaserScanSettings, laser_scan
from graspe_data.observation.smoothness import smoothness
from model_zoo.augmentation.lidar_failure import (
    LidarFailure,
    lose_points,
    lose_rays,
    scattered_smoothness,
)

SCAN = LaserScanSettings()
AZIMUTH = (np.arange(720) + 0.5) * math.pi / 720 - math.pi / 2
CIRCLE = np.stack([5 * np.cos(AZIMUTH), 5 * np.sin(AZIMUTH), 0.5 + 0 * AZIMUTH], axis=1)
CLOUD = CIRCLE.astype(np.float32)


def random(seed: int = 0) -> np.random.Generator:
    return np.random.default_rng(seed)


@given(st.floats(-1.5, 1.5), st.floats(0, 2 * math.pi))
def test_points_of_a_sector_are_lost_and_no_others(middle: float, width: float) -> None:
    index, way = lose_points(CLOUD, LidarFailure(middle, width), random())
    clear = np.abs(np.abs(AZIMUTH - middle) - width / 2) > 1e-3
    outside = np.abs(AZIMUTH - middle) > width / 2
    left = np.isin(np.arange(720), index)
    assert np.array_equal(left[clear], outside[clear])
    assert (way == 1).all()


@pytest.mark.parametrize("middle", [-1.2, 0.0, 0.7])
def test_the_scan_loses_the_rays_of_the_points_that_are_lost(middle: float) -> None:
    failure = LidarFailure(middle, 1.0)
    index, _ = lose_points(CLOUD, failure, random())
    expected = laser_scan(CLOUD[index], 0.0, SCAN)
    found = lose_rays(laser_scan(CLOUD, 0.0, SCAN), failure, SCAN, random())
    assert np.array_equal(found, expected)


def test_a_whole_turn_loses_everything() -> None:
    everything = LidarFailure(0.0, 2 * math.pi)
    assert len(lose_points(CLOUD, everything, random())[0]) == 0
    assert np.isinf(lose_rays(np.full(720, 3, np.float32), everything, SCAN, random())).all()


def test_thinning_loses_its_share_anywhere() -> None:
    index, way = lose_points(np.ones((20_000, 3), np.float32), LidarFailure(thinned=0.3), random())
    assert len(index) / 20_000 == pytest.approx(0.7, abs=0.02)
    assert (way == 1).all()


def test_scattered_returns_come_from_nearer() -> None:
    index, way = lose_points(
        np.ones((20_000, 3), np.float32), LidarFailure(scattered=0.2), random()
    )
    assert len(index) == 20_000
    assert (way < 1).mean() == pytest.approx(0.2, abs=0.02)
    assert way.min() >= 0.1


def test_scattered_rays_are_shorter_but_not_below_the_scans_least_range() -> None:
    scan = np.full(720, 1.0, np.float32)
    scan[:100] = np.inf
    found = lose_rays(scan, LidarFailure(scattered=0.5), SCAN, random())
    assert np.isinf(found[:100]).all()
    assert 0.2 < (found[100:] < 1).mean() < 0.5
    assert found.min() >= SCAN.minimum_range


def test_the_smoothness_of_scattered_points_is_what_equation_3_gives() -> None:
    ring = np.tile(np.array([[10.0, 0.0, 0.0]], np.float32), (21, 1))
    way = np.ones(21, np.float32)
    way[10] = 0.25
    expected = smoothness(ring * way[:, None], np.array([0, 21]))
    found = scattered_smoothness(smoothness(ring, np.array([0, 21])), way)
    assert found[10] == pytest.approx(expected[10])
    assert (np.delete(found, 10) == 0).all()
