"""Rotations, rigid transforms and the tree of frames, against closed forms and group laws."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from graspe_data.arrays import Floats
from graspe_data.errors import GeometryError
from graspe_data.geometry import (
    Transform,
    plain_frame,
    roll_pitch_yaw,
    rotation_from_quaternion,
    rotation_from_rpy,
)

HALF = np.sqrt(0.5)
same = partial(np.testing.assert_allclose, rtol=0, atol=1e-12)
close = partial(np.testing.assert_allclose, rtol=0, atol=1e-9)

angles = st.floats(-3.1, 3.1)
pitches = st.floats(-1.5, 1.5)
coordinates = st.floats(-100, 100)
vectors = st.tuples(coordinates, coordinates, coordinates).map(np.array)
transforms = st.builds(
    lambda rpy, translation: Transform(rotation_from_rpy(*rpy), translation),
    st.tuples(angles, pitches, angles),
    vectors,
)


def quaternion_of(axis: Floats, angle: float) -> Floats:
    return np.array([*np.sin(angle / 2) * axis, np.cos(angle / 2)])


@pytest.mark.parametrize(
    ("quaternion", "image_of_x", "image_of_y"),
    [
        ((0, 0, 0, 1), (1, 0, 0), (0, 1, 0)),
        ((HALF, 0, 0, HALF), (1, 0, 0), (0, 0, 1)),
        ((0, HALF, 0, HALF), (0, 0, -1), (0, 1, 0)),
        ((0, 0, HALF, HALF), (0, 1, 0), (-1, 0, 0)),
        ((0, 0, 1, 0), (-1, 0, 0), (0, -1, 0)),
    ],
)
def test_quaternions_are_x_y_z_w_and_turn_by_the_right_hand(
    quaternion: tuple[float, ...], image_of_x: tuple[float, ...], image_of_y: tuple[float, ...]
) -> None:
    rotation = rotation_from_quaternion(np.array(quaternion, np.float64))
    same(rotation[:, 0], image_of_x)
    same(rotation[:, 1], image_of_y)


@given(vectors.filter(lambda axis: float(np.linalg.norm(axis)) > 0.01), angles, vectors)
def test_a_quaternion_turns_as_the_formula_of_rodrigues(
    axis: Floats, angle: float, point: Floats
) -> None:
    unit = axis / np.linalg.norm(axis)
    turned = (
        point * np.cos(angle)
        + np.cross(unit, point) * np.sin(angle)
        + unit * (unit @ point) * (1 - np.cos(angle))
    )
    rotation = rotation_from_quaternion(quaternion_of(unit, angle))
    close(rotation @ point, turned)


@given(st.floats(1e-6, 1e6), angles)
def test_the_length_and_the_sign_of_a_quaternion_do_not_matter(scale: float, angle: float) -> None:
    quaternion = quaternion_of(np.array([0.6, 0.0, 0.8]), angle)
    expected = rotation_from_quaternion(quaternion)
    same(rotation_from_quaternion(scale * quaternion), expected)
    same(rotation_from_quaternion(-quaternion), expected)


def test_many_quaternions_at_once_are_each_of_them() -> None:
    quaternions = np.random.default_rng(0).normal(size=(4, 5, 4))
    rotations = rotation_from_quaternion(quaternions)
    assert rotations.shape == (4, 5, 3, 3)
    np.testing.assert_array_equal(rotations[2, 3], rotation_from_quaternion(quaternions[2, 3]))


@pytest.mark.parametrize("bad", [(0, 0, 0, 0), (np.nan, 0, 0, 1), (1e-300, 0, 0, 0)])
def test_a_quaternion_without_length_is_refused(bad: tuple[float, ...]) -> None:
    sound = (0.0, 0.0, 0.0, 1.0)
    with pytest.raises(GeometryError, match="quaternion of zero length"):
        rotation_from_quaternion(np.array([sound, bad, sound], np.float64))


@given(angles, pitches, angles)
def test_roll_pitch_and_yaw_come_back(roll: float, pitch: float, yaw: float) -> None:
    rotation = rotation_from_rpy(roll, pitch, yaw)
    same(rotation @ rotation.T, np.eye(3))
    same(np.linalg.det(rotation), 1.0)
    close(roll_pitch_yaw(rotation), (roll, pitch, yaw))


def test_yaw_turns_last_as_in_urdf() -> None:
    nose_down_then_left = rotation_from_rpy(0.0, np.pi / 2, np.pi / 2)
    same(nose_down_then_left @ [1, 0, 0], [0, 0, -1])
    same(nose_down_then_left @ [0, 0, 1], [0, 1, 0])


@pytest.mark.parametrize("pitch", [-np.pi / 2, np.pi / 2])
def test_straight_up_and_down_have_a_pitch(pitch: float) -> None:
    assert roll_pitch_yaw(rotation_from_rpy(0.3, pitch, 0.7))[1] == pytest.approx(pitch, abs=1e-7)


@given(transforms, vectors)
def test_the_inverse_leads_back(transform: Transform, point: Floats) -> None:
    there = transform.apply(point)
    close(transform.inverse().apply(there), point)
    both = transform @ transform.inverse()
    same(both.rotation, np.eye(3))
    close(both.translation, np.zeros(3))


@given(transforms, transforms, vectors)
def test_a_product_applies_the_inner_one_first(
    outer: Transform, inner: Transform, point: Floats
) -> None:
    expected = outer.apply(inner.apply(point))
    close((outer @ inner).apply(point), expected)


def test_a_transform_carries_points_of_the_child_into_the_parent() -> None:
    sensor = Transform.from_quaternion(np.array([1.0, 2.0, 3.0]), np.array([0, 0, HALF, HALF]))
    same(sensor.apply(np.array([[1.0, 0, 0]])), [[1, 3, 3]])
    unmoved = np.array([4.0, 5.0, 6.0])
    np.testing.assert_array_equal(Transform.identity().apply(unmoved), unmoved)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("shape", [(3,), (0, 3), (7, 3), (2, 5, 3)])
def test_points_of_any_shape_keep_it_and_their_type(
    shape: tuple[int, ...], dtype: type[np.floating]
) -> None:
    moved = Transform.identity().apply(np.ones(shape, dtype))
    assert moved.shape == shape
    assert moved.dtype == dtype


def test_old_recordings_write_a_slash_before_a_frame() -> None:
    assert plain_frame("/velodyne") == plain_frame("velodyne") == "velodyne"
