"""Equations (4) and (5)."""

import numpy as np
import pytest
from pydantic import ValidationError

from graspe_data.observation.point_reliability import PointReliabilitySettings, point_reliability
from graspe_data.observation.ring_order import ring_order
from graspe_data.observation.smoothness import smoothness
from graspe_data.sensor_data import PointCloud

DEFAULT = PointReliabilitySettings()


def test_shares_and_their_weighted_sum() -> None:
    c = np.array([0.001, 0.01, 0.05, 0.1, 0.5, np.nan, np.nan], np.float32)
    found = point_reliability(c, PointReliabilitySettings(planar_below=0.011, edge_above=0.09))
    assert (found.r_edge, found.r_planar) == (0.4, 0.4)
    assert found.r_point == pytest.approx(0.2 * 0.4 + 1.0 * 0.4)


def test_no_point_no_reliability() -> None:
    found = point_reliability(np.full(3, np.nan, np.float32), DEFAULT)
    assert (found.r_edge, found.r_planar, found.r_point) == (0.0, 0.0, 0.0)


def test_the_sum_is_clipped() -> None:
    heavy = PointReliabilitySettings(planar_weight=3.0)
    assert point_reliability(np.zeros(4, np.float32), heavy).r_point == 1.0


def test_scattering_a_structured_cloud_lowers_it(cloud: PointCloud) -> None:
    rng = np.random.default_rng(5)
    direction = rng.normal(size=cloud.xyz.shape)
    values = []
    for spread in (0.0, 0.05, 0.2, 0.8, 2.0):
        xyz = (cloud.xyz + spread * direction).astype(np.float32)
        found = ring_order(xyz, cloud.ring)
        c = smoothness(xyz[found.order], found.ring_starts)
        values.append(point_reliability(c, DEFAULT))
    assert values[0].r_point > 0.7
    assert all(value.r_point < 0.5 * values[0].r_point for value in values[1:])
    assert np.all(np.diff([value.r_planar for value in values]) < 0)
    assert np.all(np.diff([value.r_edge for value in values]) > 0)


def test_thresholds_the_wrong_way_round_are_refused() -> None:
    with pytest.raises(ValidationError, match=r"planar_below 0\.2 is above edge_above 0\.1"):
        PointReliabilitySettings(planar_below=0.2)
