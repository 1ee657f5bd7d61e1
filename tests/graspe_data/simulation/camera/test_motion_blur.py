"""The flow of still points and the streaks that it draws."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from graspe_data.arrays import Floats
from graspe_data.robot import Intrinsics
from graspe_data.simulation.camera.motion_blur import OpticalFlow, blur_along

PINHOLE = Intrinsics(width=81, height=61, fx=70.0, fy=70.0, cx=40.0, cy=30.0)
TWIST = arrays(np.float64, 3, elements=st.floats(-1, 1, width=32))


def project(point: Floats) -> Floats:
    return np.asarray(PINHOLE.fx * point[:2] / point[2] + (PINHOLE.cx, PINHOLE.cy))


@given(TWIST, TWIST, st.integers(0, 80), st.integers(0, 60), st.floats(0.5, 50))
def test_it_is_the_derivative_of_the_projection(
    linear: Floats, angular: Floats, u: int, v: int, depth: float
) -> None:
    point = depth * np.array([(u - 40) / 70, (v - 30) / 70, 1.0])
    closeness = np.full((61, 81), 1 / depth, np.float32)
    found = OpticalFlow(PINHOLE).of(closeness, linear, angular)[v, u]
    step = 1e-5
    moved = -(linear + np.cross(angular, point)) * step
    expected = (project(point + moved) - project(point - moved)) / (2 * step)
    assert found == pytest.approx(expected, rel=1e-3, abs=0.02)


def test_the_sky_flows_by_rotation_only() -> None:
    sky = np.zeros((61, 81), np.float32)
    flow = OpticalFlow(PINHOLE)
    assert not flow.of(sky, np.array([3.0, 2, 1]), np.zeros(3)).any()
    assert flow.of(sky, np.zeros(3), np.array([0, 0.5, 0]))[30, 40, 0] == pytest.approx(-35.0)


@pytest.mark.parametrize("length", [2.0, 7.0, 15.5, 28.0])
@pytest.mark.parametrize("axis", [0, 1])
def test_a_point_becomes_a_streak_of_its_way(length: float, axis: int) -> None:
    point = np.zeros((61, 81, 3), np.float32)
    point[30, 40] = 1.0
    motion = np.zeros((61, 81, 2), np.float32)
    motion[..., axis] = length
    streak = blur_along(point, motion)[..., 0]
    profile = streak.sum(axis=axis)
    assert streak.sum() == pytest.approx(1.0, rel=0.01)
    # A row of n even pixels has the variance (n^2 - 1) / 12.
    place = np.arange(len(profile)) - (40, 30)[axis]
    assert (profile * place).sum() == pytest.approx(0.0, abs=0.01)
    assert np.sqrt(12 * (profile * place**2).sum()) == pytest.approx(length, abs=1.0)


def test_less_than_half_a_pixel_changes_nothing() -> None:
    picture = np.random.default_rng(0).random((61, 81, 3), np.float32)
    still = np.full((61, 81, 2), 0.49, np.float32)
    assert blur_along(picture, still) is picture
