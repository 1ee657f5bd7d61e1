"""The trajectory lies where the camera sees the ground."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from graspe_data.geometry import Transform, rotation_from_rpy
from graspe_data.observation.trajectory import (
    constant_velocity_arc,
    ground_homography,
    trajectory_image,
)
from graspe_data.robot import Intrinsics

BASE_HEIGHT = 0.2
OPTICAL = np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])


def _projected(
    points: NDArray[np.float64], camera: Intrinsics, mounted: Transform
) -> NDArray[np.float64]:
    """Depth times (u, v, 1) of points in base_link, step by step."""
    seen = np.asarray(mounted.inverse().apply(points), np.float64)
    return np.asarray(seen @ camera.matrix.T)


@settings(deadline=None)
@given(x=st.floats(-5, 20), y=st.floats(-5, 5))
def test_the_homography_is_the_projection_of_the_ground(x: float, y: float) -> None:
    camera = Intrinsics(width=320, height=240, fx=250.0, fy=240.0, cx=150.0, cy=119.5)
    tilted = Transform(rotation_from_rpy(0.02, 0.3, -0.1) @ OPTICAL, np.array([0.3, 0.1, 0.5]))
    expected = _projected(np.array([x, y, -BASE_HEIGHT]), camera, tilted)
    found = ground_homography(camera, tilted, BASE_HEIGHT) @ (x, y, 1)
    assert found == pytest.approx(expected, abs=1e-9)


def test_a_known_point(camera: Intrinsics, mounted: Transform) -> None:
    u, v, depth = ground_homography(camera, mounted, BASE_HEIGHT) @ (2.3, 0.4, 1)
    assert depth == pytest.approx(2.0)
    assert (u / depth, v / depth) == pytest.approx((159.5 - 250 * 0.2, 119.5 + 250 * 0.35))


def test_straight_ahead_is_symmetric_and_narrows_with_distance(
    camera: Intrinsics, mounted: Transform
) -> None:
    drawn = trajectory_image(
        constant_velocity_arc(1.0, 0.0), camera, mounted, BASE_HEIGHT, line_width=0.5
    )
    assert drawn.shape == (240, 320)
    assert drawn.dtype == np.bool_
    assert np.array_equal(drawn, drawn[:, ::-1])
    widths = drawn.sum(axis=1)
    rows = np.flatnonzero(widths)
    farthest = 119.5 + 250 * 0.7 / (3.0 - 0.3)
    assert rows[0] == pytest.approx(farthest, abs=1)
    assert rows[-1] == 239
    assert np.all(np.diff(widths[rows].astype(int)) >= 0)
    expected = 250 * 0.5 / (250 * 0.7 / (rows - 119.5))
    assert np.all((widths[rows] >= expected - 0.5) & (widths[rows] <= expected + 2.5))


def test_turning_left_is_the_mirror_of_turning_right(
    camera: Intrinsics, mounted: Transform
) -> None:
    left, right = (
        trajectory_image(
            constant_velocity_arc(1.0, omega, 40, 0.075), camera, mounted, BASE_HEIGHT, 0.4
        )
        for omega in (0.4, -0.4)
    )
    assert np.mean(left != right[:, ::-1]) < 0.001
    assert left[:, :160].sum() > 2 * left[:, 160:].sum()


@settings(deadline=None)
@given(v=st.floats(-2, 2), omega=st.floats(-2, 2), width=st.floats(0.1, 1.0))
def test_a_pixel_is_drawn_where_its_ground_is_within_half_the_width(
    v: float, omega: float, width: float
) -> None:
    camera = Intrinsics(width=160, height=120, fx=110.0, fy=110.0, cx=79.5, cy=59.5)
    tilted = Transform(rotation_from_rpy(0, 0.35, 0) @ OPTICAL, np.array([0.3, 0.0, 0.5]))
    arc = constant_velocity_arc(v, omega, 60, 0.05)
    drawn = trajectory_image(arc, camera, tilted, BASE_HEIGHT, width)
    inverse = np.linalg.inv(ground_homography(camera, tilted, BASE_HEIGHT))
    for row, column in np.argwhere(drawn)[::50]:
        # Half a pixel of play: some point of the ground around the pixel is on the ribbon.
        spread = np.linspace(-0.8, 0.8, 5)
        pixels = np.array([(column + a, row + b, 1.0) for a in spread for b in spread])
        x, y, scale = inverse @ pixels.T
        ground = np.column_stack((x / scale, y / scale))
        gaps = np.linalg.norm(ground[:, None] - arc[None, :, :2], axis=-1)
        step = abs(v) * 0.05
        assert gaps.min() <= np.hypot(width / 2, step / 2) + 1e-6
        assert scale.min() > 0


def test_what_lies_behind_the_camera_does_not_come_round(
    camera: Intrinsics, mounted: Transform
) -> None:
    backwards = constant_velocity_arc(-1.0, 0.2)
    assert not trajectory_image(backwards, camera, mounted, BASE_HEIGHT, 0.5).any()
    standing = constant_velocity_arc(0.0, 0.0)
    assert not trajectory_image(standing, camera, mounted, BASE_HEIGHT, 0.5).any()
    turned = constant_velocity_arc(4.0, 1.5, 40, 0.075)
    drawn = trajectory_image(turned, camera, mounted, BASE_HEIGHT, 0.5)
    assert drawn.any()
    assert not drawn[:120].any()


def test_a_camera_on_the_ground_sees_no_ribbon_face(camera: Intrinsics) -> None:
    lying = Transform(OPTICAL, np.array([0.0, 0.0, -BASE_HEIGHT]))
    arc = constant_velocity_arc(1.0, 0.0)
    drawn = trajectory_image(arc, camera, lying, BASE_HEIGHT, 0.5)
    assert drawn.sum() <= 2 * 320


def test_trajectories_longer_than_any_picture(camera: Intrinsics, mounted: Transform) -> None:
    arc = constant_velocity_arc(1e4, 1e-3, 10, 1.0)
    drawn = trajectory_image(arc, camera, mounted, BASE_HEIGHT, 1e3)
    assert drawn[-1].all()
