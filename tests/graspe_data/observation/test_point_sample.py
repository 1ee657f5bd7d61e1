"""The same points are drawn every time, each as likely as another."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from graspe_data.observation.point_sample import front, row_seed, sample_points

POINTS = np.arange(3000, dtype=np.float32).reshape(1000, 3)
VALUES = np.arange(1000, dtype=np.float32)


@settings(deadline=None)
@given(count=st.integers(1, 1500), seed=st.integers(0, 2**64 - 1))
def test_draws_without_replacement_in_order_and_pads_with_nan(count: int, seed: int) -> None:
    found = sample_points(POINTS, VALUES, VALUES, count, seed)
    real = min(count, 1000)
    assert found.point_count == real
    assert found.points.shape == (count, 3)
    assert np.all(np.diff(found.smoothness[:real]) > 0)
    assert np.array_equal(found.points[:real, 0], 3 * found.smoothness[:real])
    for values in (found.points, found.intensity, found.smoothness):
        assert not np.isnan(values[:real]).any()
        assert np.isnan(values[real:]).all()


def test_the_draw_is_fixed_for_good() -> None:
    found = sample_points(POINTS, None, VALUES, 5, seed=7)
    assert found.smoothness.tolist() == [6.0, 37.0, 114.0, 614.0, 865.0]
    assert np.isnan(found.intensity).all()


def test_every_point_is_as_likely() -> None:
    hits = np.zeros(1000)
    for seed in range(400):
        drawn = sample_points(POINTS, None, VALUES, 500, seed).smoothness.astype(int)
        hits[drawn] += 1
    assert hits.mean() == 200
    assert hits.std() == pytest.approx(10, rel=0.1)


def test_the_seed_of_a_row_names_all_it_depends_on() -> None:
    seeds = {row_seed(a, b, c) for a in (0, 1) for b in ("ab", "cd") for c in (5, -5)}
    assert len(seeds) == 8
    assert row_seed(1, "ab", 5) == 16923531314741878815


@pytest.mark.parametrize("half_angle", [0.3, np.pi / 2, 2.5, np.pi])
def test_the_front_is_a_sector(half_angle: float) -> None:
    xyz = np.random.default_rng(0).normal(size=(2000, 3)).astype(np.float32)
    azimuth = np.arctan2(xyz[:, 1], xyz[:, 0])
    assert np.array_equal(front(xyz, half_angle), np.abs(azimuth) <= half_angle)


def test_the_edge_of_the_front_half_is_in_it() -> None:
    sides = np.array([[0, 1, 0], [0, -1, 0], [-1e-6, 1, 0]], np.float32)
    assert front(sides, np.pi / 2).tolist() == [True, True, False]
