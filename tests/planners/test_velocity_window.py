"""V_s, V_d, and the restriction to the camera's view."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from graspe_data.calibration import Calibration
from graspe_data.robot import Limits
from planners.velocity_window import (
    VelocityWindowSettings,
    stays_in_view,
    velocity_window,
    view_bearings,
)

LIMITS = Limits(linear_velocity=(0.0, 0.6), yaw_rate=(-0.6, 0.6))


@given(
    v=st.floats(-1, 1),
    omega=st.floats(-2, 2),
    interval=st.floats(0.05, 1),
    steps=st.tuples(st.floats(0.02, 0.5), st.floats(0.02, 0.5)),
)
def test_every_velocity_is_within_the_limits_and_within_reach(
    v: float, omega: float, interval: float, steps: tuple[float, float]
) -> None:
    settings = VelocityWindowSettings(interval_s=interval, linear_step=steps[0], yaw_step=steps[1])
    found = velocity_window(LIMITS, (v, omega), settings).velocities
    now = np.clip((v, omega), (0, -0.6), (0.6, 0.6))
    assert len(found) > 0
    assert np.all((found >= (-1e-9, -0.6 - 1e-9)) & (found <= 0.6 + 1e-9))
    assert np.all(np.abs(found - now) <= np.array([1.0, 3.2]) * interval + 1e-9)
    assert not np.any(np.all(found == 0, axis=1))


def test_the_lattice_is_that_of_the_steps_between_the_ends_of_the_window() -> None:
    window = velocity_window(LIMITS, (0.33, 0.0), VelocityWindowSettings(interval_s=0.2))
    assert window.linear == pytest.approx([0.13, 0.2, 0.3, 0.4, 0.53])
    assert window.yaw_rate == pytest.approx(np.arange(-6, 7) / 10)
    assert 0.0 in window.yaw_rate


def test_values_lie_on_the_lattice_where_they_belong() -> None:
    window = velocity_window(LIMITS, (0.0, 0.0), VelocityWindowSettings(interval_s=0.2))
    kept = window.keep(window.velocities[:, 1] > 0)
    laid = kept.on_lattice(kept.velocities[:, 1])
    assert np.array_equal(np.isnan(laid), ~kept.allowed)
    assert np.nanmin(laid) > 0
    assert np.array_equal(laid[kept.allowed], kept.velocities[:, 1])


def test_sharp_arcs_leave_the_view_and_rotations_are_kept(calibration: Calibration) -> None:
    right, left = view_bearings(calibration.intrinsics, calibration.base_from_camera)
    assert left == pytest.approx(-right)
    assert left == pytest.approx(np.arctan(32 / 45), abs=0.03)
    velocities = np.array([[0.5, 0.0], [0.5, 0.39], [0.5, 0.45], [0.1, -0.45], [0, 2], [-0.1, 0]])
    kept = stays_in_view(velocities, 3.0, (right, left))
    assert kept.tolist() == [True, True, False, False, True, False]
