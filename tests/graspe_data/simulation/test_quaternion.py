"""Quaternions of rotations: the way back from the rotations of quaternions."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from graspe_data.geometry import rotation_from_quaternion, rotation_from_rpy
from graspe_data.simulation.quaternion import quaternion_from_rotation

ANGLES = st.floats(-np.pi, np.pi)


@given(st.tuples(ANGLES, ANGLES, ANGLES))
def test_a_rotation_comes_back_from_its_quaternion(angles: tuple[float, float, float]) -> None:
    rotation = rotation_from_rpy(*angles)
    quaternion = quaternion_from_rotation(rotation)
    assert np.linalg.norm(quaternion) == pytest.approx(1.0)
    assert quaternion[3] >= 0.0
    np.testing.assert_allclose(rotation_from_quaternion(quaternion), rotation, atol=1e-12)


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_half_a_turn_has_the_axis_as_its_quaternion(axis: int) -> None:
    flipped = -np.eye(3)
    flipped[axis, axis] = 1.0
    expected = np.zeros(4)
    expected[axis] = 1.0
    np.testing.assert_allclose(np.abs(quaternion_from_rotation(flipped)), expected)


def test_a_turn_to_the_left_is_about_z() -> None:
    quaternion = quaternion_from_rotation(rotation_from_rpy(0.0, 0.0, 0.6))
    np.testing.assert_allclose(quaternion, [0.0, 0.0, np.sin(0.3), np.cos(0.3)], atol=1e-15)
