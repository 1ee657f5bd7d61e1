"""Equations (1) and (2), against a loop over the points."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import ValidationError

from graspe_data.errors import ObservationError
from graspe_data.geometry import Transform, rotation_from_rpy
from graspe_data.observation.intensity_map.grid import GridSettings
from graspe_data.observation.intensity_map.layers import (
    LayerSettings,
    ReturnSettings,
    intensity_layers,
)
from graspe_data.sensor_data import PointCloud
from tests.graspe_data.observation.intensity_map.slow_reference import slow_layers

LEVEL = Transform(np.eye(3), np.array([0.2, 0.0, 0.4]))
TILTED = Transform(rotation_from_rpy(0.05, -0.1, 2.0), np.array([0.2, -0.1, 0.4]))
SMALL = GridSettings(cells=20, cell_m=0.25)


def cloud_of(*returns: tuple[float, float, float, float]) -> PointCloud:
    values = np.array(returns, np.float32).reshape(-1, 4)
    return PointCloud(0, "velodyne", values[:, :3].copy(), values[:, 3].copy(), None)


def random_cloud(points: int, seed: int, maximum: float = 255) -> PointCloud:
    random = np.random.default_rng(seed)
    xyz = random.normal(0, (2, 2, 0.5), (points, 3)).astype(np.float32)
    strength = np.floor(random.uniform(0, 1, points) ** 3 * 256) * maximum / 255
    strength[0] = maximum
    return PointCloud(0, "velodyne", xyz, strength.astype(np.float32), None)


@settings(deadline=None, max_examples=40)
@given(
    points=st.integers(100, 300),
    seed=st.integers(0, 10_000),
    cell=st.sampled_from(["sum", "max", "mean"]),
    heights=st.sampled_from(["lidar", "ground"]),
    maximum=st.sampled_from([1.0, 255.0, 65535.0]),
    tilted=st.booleans(),
    edges=st.lists(st.integers(-20, 20), min_size=2, max_size=9, unique=True),
)
def test_agrees_exactly_with_a_loop_over_the_points(
    points: int, seed: int, cell: Any, heights: Any, maximum: float, tilted: bool, edges: list[int]
) -> None:
    intervals = tuple((low / 10, high / 10) for low, high in pairwise(sorted(edges)))
    chosen = LayerSettings(grid=SMALL, intervals=intervals, heights=heights, cell=cell)
    returns = ReturnSettings(intensity_maximum=maximum, minimum_range=0.5, base_height=0.6)
    cloud, mounting = random_cloud(points, seed, maximum), TILTED if tilted else LEVEL
    found = intensity_layers(cloud, mounting, returns, chosen)
    assert found.dtype == np.float32
    assert np.array_equal(found, slow_layers(cloud, mounting, returns, chosen))


def test_the_order_of_the_points_does_not_matter() -> None:
    cloud = random_cloud(3000, 3)
    assert cloud.intensity is not None
    order = np.random.default_rng(0).permutation(3000)
    shuffled = PointCloud(0, "velodyne", cloud.xyz[order], cloud.intensity[order], None)
    for cell in ("sum", "max", "mean"):
        chosen = LayerSettings(grid=SMALL, cell=cell)
        first = intensity_layers(cloud, LEVEL, ReturnSettings(), chosen)
        assert np.array_equal(first, intensity_layers(shuffled, LEVEL, ReturnSettings(), chosen))


def test_the_robot_stands_in_the_middle_and_looks_to_row_0() -> None:
    cloud = cloud_of((4.96, 0.01, 0, 255), (0.02, 4.96, 0, 255), (-4.96, -4.96, 0, 255))
    origin = Transform(np.eye(3), np.zeros(3))
    found = intensity_layers(cloud, origin, ReturnSettings(), LayerSettings())
    assert found.shape == (3, 200, 200)
    assert np.argwhere(found).tolist() == [[1, 0, 99], [1, 99, 0], [1, 199, 199]]


@pytest.mark.parametrize(("cell", "expected"), [("sum", 1.0), ("max", 150 / 255), ("mean", 0.5)])
def test_a_cell_holds_no_more_than_the_sensors_maximum(cell: Any, expected: float) -> None:
    cloud = cloud_of((2.01, 0.01, 0, 150), (2.02, 0.02, 0.05, 105))
    found = intensity_layers(cloud, LEVEL, ReturnSettings(), LayerSettings(cell=cell))
    assert found.max() == pytest.approx(expected)


def test_a_bound_belongs_to_the_interval_above_it() -> None:
    chosen = LayerSettings(intervals=((-1, 0), (0, 1)))
    for height, layer in ((-1.0, [0]), (-0.01, [0]), (0.0, [1]), (1.0, [])):
        found = intensity_layers(cloud_of((2, 0, height, 200)), LEVEL, ReturnSettings(), chosen)
        assert np.flatnonzero(found.any(axis=(1, 2))).tolist() == layer


def test_heights_count_from_the_lidar_or_from_the_ground() -> None:
    cloud, returns = cloud_of((2, 0, 0, 255)), ReturnSettings(base_height=0.5)
    for heights, height in (("lidar", 0.0), ("ground", 0.9)):
        chosen = LayerSettings(intervals=((height - 0.1, height + 0.1),), heights=heights)
        assert intensity_layers(cloud, LEVEL, returns, chosen).any()


def test_returns_from_the_robot_itself_and_damage_do_not_count() -> None:
    cloud = cloud_of((0.3, 0, 0, 255), (2, 0, 0, 200), (3e38, 3e38, 0, 50), (0, 0, 0, 255))
    returns = ReturnSettings(minimum_range=0.45)
    found = intensity_layers(cloud, LEVEL, returns, LayerSettings())
    assert np.count_nonzero(found) == 1
    with pytest.raises(ObservationError, match="no returns within the lidar's range"):
        intensity_layers(cloud_of((0.3, 0, 0, 255)), LEVEL, returns, LayerSettings())


@pytest.mark.parametrize(
    ("intervals", "fault"),
    [
        (((0.2, 0.1),), "empty"),
        (((0, 0.2), (0.1, 0.3)), r"one begins at 0\.1, before the last ends, 0\.2"),
        (tuple((float(k), k + 1.0) for k in range(9)), "at most 8"),
        ((), "at least 1"),
    ],
)
def test_intervals_that_overlap_are_refused(intervals: Any, fault: str) -> None:
    with pytest.raises(ValidationError, match=fault):
        LayerSettings(intervals=intervals)
