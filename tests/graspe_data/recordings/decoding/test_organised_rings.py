from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from graspe_data.geometry import rotation_from_rpy
from graspe_data.recordings.decoding.organised_rings import organised_rings

Grid = NDArray[np.float64]


def spinning(rings: int, columns: int, half_height: float, turn: float = 360.0) -> Grid:
    """Returns (columns, rings, 3) in a room with a floor; 0.4 % noise of range."""
    elevation = np.radians(np.linspace(-half_height, half_height, rings))
    azimuth = np.radians(np.linspace(-turn / 2, turn / 2, columns, endpoint=False))
    down, around = np.meshgrid(elevation, azimuth)
    floor = np.where(down < 0, 0.9 / np.maximum(np.sin(-down), 1e-3), 1e9)
    reach = np.minimum(8 / np.cos(down), floor)
    reach = reach * (1 + np.random.default_rng(0).normal(0, 0.004, reach.shape))
    flat = reach * np.cos(down)
    return np.stack([flat * np.cos(around), flat * np.sin(around), reach * np.sin(down)], -1)


def picture(height: int, width: int, focal: float) -> Grid:
    """A depth camera's picture (height, width, 3) of random depths, looking along x."""
    v, u = np.mgrid[:height, :width]
    rays = [np.ones((height, width)), (width / 2 - u) / focal, (height / 2 - v) / focal]
    depth = np.random.default_rng(0).uniform(1, 6, (height, width, 1))
    return np.stack(rays, -1) * depth


def rings_of(cloud: Grid) -> NDArray[np.int32] | None:
    found = organised_rings(*(cloud[..., axis].astype(np.float32) for axis in range(3)))
    return None if found is None else found.reshape(cloud.shape[:2])


LIDARS = {
    "VLP-16": (16, 180, 15.0, 360.0),
    "a dense one": (128, 512, 11.0, 360.0),
    "more rings than columns": (64, 40, 20.0, 360.0),
    "a narrow field": (40, 300, 8.0, 30.0),
    "two rings": (2, 180, 1.0, 360.0),
}


@pytest.mark.parametrize("tilt", [(0.0, 0.0, 0.0), (0.3, 0.5, 1.0), (1.5707963, 0.0, 0.0)])
@pytest.mark.parametrize("shape", LIDARS.values(), ids=LIDARS)
def test_the_side_that_is_a_ring_is_found_in_either_order(
    shape: tuple[int, int, float, float], tilt: tuple[float, float, float]
) -> None:
    cloud = spinning(*shape) @ rotation_from_rpy(*tilt).T
    truth = np.broadcast_to(np.arange(shape[0]), cloud.shape[:2])
    np.testing.assert_array_equal(rings_of(cloud), truth)
    np.testing.assert_array_equal(rings_of(cloud.transpose(1, 0, 2)), truth.T)


@pytest.mark.parametrize("lost", [0.0, np.nan, np.inf])
def test_missing_returns_change_nothing(lost: float) -> None:
    cloud = spinning(16, 360, 15.0)
    cloud[np.random.default_rng(1).random(cloud.shape[:2]) < 0.6] = lost
    cloud[:, 12:] = lost
    found = rings_of(cloud)
    assert found is not None
    assert (found[:, :12] == np.arange(12)).all()


@pytest.mark.parametrize(
    ("height", "width", "focal"),
    [(480, 640, 550.0), (240, 320, 900.0), (48, 64, 55.0), (24, 32, 28.0), (8, 8, 10.0)],
)
def test_the_picture_of_a_depth_camera_has_no_rings(height: int, width: int, focal: float) -> None:
    cloud = picture(height, width, focal)
    assert rings_of(cloud) is None
    assert rings_of(cloud[..., [1, 2, 0]] * (-1, -1, 1)) is None


def test_beams_that_start_beside_the_centre_are_rings_still() -> None:
    cloud = spinning(64, 512, 22.0)
    level = cloud * (1, 1, 0)
    aside = 0.027 * level / np.linalg.norm(level, axis=-1, keepdims=True)
    assert rings_of(cloud + aside) is not None


def test_columns_that_are_staggered_are_no_fault() -> None:
    cloud = spinning(64, 512, 22.0)
    rows = np.stack([np.roll(cloud[:, k], 3 * k % 17, axis=0) for k in range(64)])
    np.testing.assert_array_equal(
        rings_of(rows), np.broadcast_to(np.arange(64)[:, None], (64, 512))
    )


def test_second_returns_lie_on_the_rings_of_the_first() -> None:
    first = spinning(16, 180, 15.0).transpose(1, 0, 2)
    stacked = rings_of(np.concatenate([first, 1.1 * first]))
    in_turn = rings_of(np.repeat(first, 2, axis=0))
    assert stacked is not None
    assert in_turn is not None
    np.testing.assert_array_equal(stacked[:16], stacked[16:])
    np.testing.assert_array_equal(in_turn[::2], in_turn[1::2])
    assert len(np.unique(stacked)) == len(np.unique(in_turn)) == 16


@pytest.mark.parametrize(
    "cloud",
    [
        np.random.default_rng(0).normal(0, 5, (16, 100, 3)),
        np.arange(1.0, 25).reshape(2, 4, 3),
        np.ones((4, 9, 3)),
        np.zeros((4, 9, 3)),
        np.full((5, 5, 3), np.nan),
        spinning(16, 1, 15.0),
        spinning(16, 180, 15.0)
        .reshape(-1, 3)[np.random.default_rng(1).permutation(2880)]
        .reshape(30, 96, 3),
    ],
    ids=["noise", "a line", "a point", "nothing", "NaN", "one firing", "shuffled"],
)
def test_what_has_no_rings_is_given_none(cloud: Grid) -> None:
    assert rings_of(cloud) is None


@settings(max_examples=60, deadline=None)
@given(
    st.integers(2, 40),
    st.integers(8, 90),
    st.floats(2, 45),
    st.tuples(*[st.floats(-3, 3)] * 3),
)
def test_rings_do_not_depend_on_the_order_of_rows_nor_on_the_tilt(
    rings: int, columns: int, half_height: float, tilt: tuple[float, float, float]
) -> None:
    cloud = spinning(rings, columns, half_height)
    order = np.random.default_rng(rings).permutation(rings)
    shuffled = cloud[:, order] @ rotation_from_rpy(*tilt).T
    np.testing.assert_array_equal(
        rings_of(shuffled), np.broadcast_to(np.arange(rings), shuffled.shape[:2])
    )
