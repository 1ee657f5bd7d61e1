"""Equations (4) and (5)."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from pydantic import ValidationError

from graspe_data.errors import ObservationError
from graspe_data.observation.point_reliability import (
    CoverageSettings,
    PointReliabilitySettings,
    coverage,
    point_reliability,
)
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


def ring(count: int = 1440, turn: float = 2 * np.pi) -> NDArray[np.float32]:
    azimuth = np.arange(count) * turn / count - turn / 2
    return np.stack([5 * np.cos(azimuth), 5 * np.sin(azimuth), 0 * azimuth], 1).astype(np.float32)


def test_coverage_is_1_where_all_sectors_return_alike_and_0_without_returns() -> None:
    assert coverage(ring(), CoverageSettings()) == pytest.approx(1.0, abs=0.01)
    assert coverage(np.empty((0, 3), np.float32), CoverageSettings()) == 0.0
    behind = -np.abs(ring()) * np.array([1, 0, 0], np.float32)
    assert coverage(behind, CoverageSettings(half_angle=1.5)) == 0.0


@given(st.floats(-1.2, 1.2), st.floats(0.3, 1.5))
def test_a_lost_sector_lowers_coverage_by_its_share(middle: float, width: float) -> None:
    points = ring()
    azimuth = np.arctan2(points[:, 1], points[:, 0])
    left = points[np.abs(azimuth - middle) > width / 2]
    seen = max(0.0, min(middle + width / 2, np.pi / 2) - max(middle - width / 2, -np.pi / 2))
    found = coverage(left, CoverageSettings(sectors=90))
    assert found == pytest.approx(1 - seen / np.pi, abs=0.03)


def test_a_thin_cloud_is_noticed_where_returns_are_expected_by_number() -> None:
    half = ring()[::2]
    assert coverage(half, CoverageSettings()) == pytest.approx(1.0, abs=0.02)
    assert coverage(half, CoverageSettings(returns=60)) == pytest.approx(0.5, abs=0.02)


def test_with_coverage_a_lost_sector_lowers_r_point_and_without_it_does_not() -> None:
    covering = PointReliabilitySettings(coverage=CoverageSettings())
    whole = ring()
    left = whole[np.arctan2(whole[:, 1], whole[:, 0]) > -0.5]
    flat = np.zeros(len(whole), np.float32)
    printed = [point_reliability(flat[: len(each)], DEFAULT).r_point for each in (whole, left)]
    found = [point_reliability(flat[: len(e)], covering, e).r_point for e in (whole, left)]
    assert printed == [1.0, 1.0]
    assert found[0] > 0.98
    assert found[1] < 0.75
    assert point_reliability(flat, covering, whole).r_planar == 1.0


def test_coverage_needs_the_points() -> None:
    covering = PointReliabilitySettings(coverage=CoverageSettings())
    with pytest.raises(ObservationError, match="needs the points"):
        point_reliability(np.zeros(3, np.float32), covering)
