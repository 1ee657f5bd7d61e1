"""Beams as rays in a cone."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from graspe_data.simulation.lidar.beams import sub_rays


def axis(azimuth: float, elevation: float, count: int = 1) -> np.ndarray:
    level = np.cos(elevation)
    unit = [level * np.cos(azimuth), level * np.sin(azimuth), np.sin(elevation)]
    return np.tile(unit, (count, 1))


anywhere = (st.floats(-np.pi, np.pi), st.floats(-0.3, 0.3))


@settings(deadline=None)
@given(*anywhere, st.integers(2, 9), st.floats(1e-3, 0.02))
def test_rays_fill_the_cone_as_an_evenly_lit_disc(
    azimuth: float, elevation: float, count: int, divergence: float
) -> None:
    beam = axis(azimuth, elevation)
    rays = sub_rays(beam, divergence, count)[0].astype(np.float64)
    np.testing.assert_allclose(np.linalg.norm(rays, axis=1), 1.0, atol=1e-6)
    off = rays / (rays @ beam[0])[:, None] - beam
    np.testing.assert_allclose(off.mean(axis=0), 0.0, atol=2e-7)
    assert np.linalg.norm(off, axis=1).max() <= divergence / 2 + 2e-7
    np.testing.assert_allclose((off**2).sum(axis=1).mean(), (divergence / 2) ** 2 / 2, rtol=2e-3)


@settings(deadline=None)
@given(*anywhere)
def test_one_ray_is_the_axis(azimuth: float, elevation: float) -> None:
    beam = axis(azimuth, elevation)
    np.testing.assert_allclose(sub_rays(beam, 0.003, 1)[0], beam, atol=1e-7)


@settings(deadline=None)
@given(*anywhere, st.integers(5, 9))
def test_from_five_rays_on_one_is_in_the_middle(
    azimuth: float, elevation: float, count: int
) -> None:
    beam = axis(azimuth, elevation)
    np.testing.assert_allclose(sub_rays(beam, 0.003, count)[0, 0], beam[0], atol=1e-7)


def test_no_two_beams_are_spread_alike() -> None:
    rays = sub_rays(axis(0.0, 0.0, 100), 0.003, 5)[:, 1]
    assert len(np.unique(rays, axis=0)) == 100
