from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from graspe_data.geometry import Transform, rotation_from_rpy
from graspe_data.observation.trajectory import (
    PredictedTrajectory,
    constant_velocity_arc,
    trajectory_image,
)
from graspe_data.robot import Intrinsics

OPTICAL = np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
CAMERA = Intrinsics(width=320, height=240, fx=240.0, fy=240.0, cx=159.5, cy=119.5)
TILTED = Transform(rotation_from_rpy(0.0, 0.45, 0.0) @ OPTICAL, np.array([0.45, 0.0, 0.15]))


def predicted(behind: float) -> PredictedTrajectory:
    return PredictedTrajectory(CAMERA, TILTED, 0.5, 0.5, behind=behind)


def test_a_slow_arc_is_seen_from_behind_the_camera_alone() -> None:
    assert not predicted(0.0).draw(0.2, 0.3).any()
    left, right = predicted(1.0).draw(0.2, 0.3), predicted(1.0).draw(0.2, -0.3)
    assert left.sum() > 1000
    assert (left != right[:, ::-1]).sum() < 0.01 * left.sum()
    assert left[:, :160].sum() > left[:, 160:].sum()


@settings(deadline=None, max_examples=30)
@given(behind=st.floats(0, 3), v=st.floats(0.1, 1.0))
def test_to_stand_behind_is_to_see_the_arc_farther_ahead(behind: float, v: float) -> None:
    arc = constant_velocity_arc(v, 0.0)
    farther = arc + np.array((behind, 0.0, 0.0))
    expected = trajectory_image(farther, CAMERA, TILTED, 0.5, 0.5)
    assert np.array_equal(predicted(behind).draw(v, 0.0), expected)


def test_without_a_distance_it_is_what_the_camera_sees() -> None:
    expected = trajectory_image(constant_velocity_arc(1.0, 0.0), CAMERA, TILTED, 0.5, 0.5)
    assert np.array_equal(predicted(0.0).draw(1.0, 0.0), expected)
    assert expected.sum() == pytest.approx(predicted(0.0).draw(1.0, 0.01).sum(), rel=0.05)
