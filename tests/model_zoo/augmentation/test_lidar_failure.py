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
    ReturnsLeft,
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
    found = lose_points(CLOUD, LidarFailure(middle, width), random())
    index, way = found.index, found.way
    clear = np.abs(np.abs(AZIMUTH - middle) - width / 2) > 1e-3
    outside = np.abs(AZIMUTH - middle) > width / 2
    left = np.isin(np.arange(720), index)
    assert np.array_equal(left[clear], outside[clear])
    assert (way == 1).all()


@pytest.mark.parametrize("middle", [-1.2, 0.0, 0.7])
def test_the_scan_loses_the_rays_of_the_points_that_are_lost(middle: float) -> None:
    failure = LidarFailure(middle, 1.0)
    index = lose_points(CLOUD, failure, random()).index
    expected = laser_scan(CLOUD[index], 0.0, SCAN)
    found = lose_rays(laser_scan(CLOUD, 0.0, SCAN), failure, SCAN, random())
    assert np.array_equal(found, expected)


def test_a_whole_turn_loses_everything() -> None:
    everything = LidarFailure(0.0, 2 * math.pi)
    assert len(lose_points(CLOUD, everything, random()).index) == 0
    assert np.isinf(lose_rays(np.full(720, 3, np.float32), everything, SCAN, random())).all()


def test_thinning_loses_its_share_anywhere() -> None:
    found = lose_points(np.ones((20_000, 3), np.float32), LidarFailure(thinned=0.3), random())
    index, way = found.index, found.way
    assert len(index) / 20_000 == pytest.approx(0.7, abs=0.02)
    assert (way == 1).all()


def test_scattered_returns_come_from_nearer() -> None:
    found = lose_points(np.ones((20_000, 3), np.float32), LidarFailure(scattered=0.2), random())
    index, way = found.index, found.way
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
    ones, zeros = np.ones(21, np.float32), np.zeros(21, np.float32)
    left = ReturnsLeft(np.arange(21), way, ones, zeros)
    found = scattered_smoothness(smoothness(ring, np.array([0, 21])), left, random())
    assert found[10] == pytest.approx(expected[10])
    assert (np.delete(found, 10) == 0).all()


def test_the_smoothness_of_what_neighbours_met_together_is_that_of_equation_3() -> None:
    share, number = 0.04, 4000
    away = 0.5 * (1 + share * random(1).standard_normal(number))
    ring = np.column_stack([away, np.zeros((number, 2))]).astype(np.float32)
    expected = smoothness(ring, np.array([0, number]))[5:-5]
    same = np.full(number, 1.0, np.float32)
    left = ReturnsLeft(np.arange(number), 0.1 * same, same, share * same)
    found = scattered_smoothness(np.zeros(number, np.float32), left, random(2))
    for q in (0.25, 0.5, 0.9):
        assert np.quantile(found, q) == pytest.approx(np.quantile(expected, q), rel=0.1)


@pytest.mark.parametrize("failure", [LidarFailure(dust=1.0), LidarFailure(near_leaves=0.7)])
def test_the_scan_shows_what_is_before_the_lidar(failure: LidarFailure) -> None:
    scan = np.full(720, 6.0, np.float32)
    scan[::3] = np.inf
    found = lose_rays(scan, failure, SCAN, random(5))
    assert (found <= scan).all()
    assert (found < scan).mean() > 0.1
    assert found.min() >= SCAN.minimum_range
