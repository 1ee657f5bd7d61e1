"""The arc of a constant velocity, against small Euler steps and the circle."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from graspe_data.observation.trajectory import constant_velocity_arc

SPEEDS = st.floats(-3, 3)
RATES = st.floats(-3, 3)


def test_straight_ahead_and_turning_on_the_spot() -> None:
    straight = constant_velocity_arc(0.5, 0.0, steps=4, step=0.5)
    assert np.array_equal(straight[:, 0], [0, 0.25, 0.5, 0.75, 1.0])
    assert not straight[:, 1:].any()
    turning = constant_velocity_arc(0.0, 1.0)
    assert not turning[:, :2].any()
    assert turning[-1, 2] == pytest.approx(3.0)


def test_a_quarter_of_a_circle() -> None:
    end = constant_velocity_arc(np.pi / 2, np.pi / 2, steps=1, step=1.0)[-1]
    assert end == pytest.approx([1.0, 1.0, np.pi / 2])


@settings(deadline=None)
@given(v=SPEEDS, omega=RATES)
def test_agrees_with_integration(v: float, omega: float) -> None:
    fine = 20_000
    yaw = omega * (np.arange(fine) + 0.5) * (3.0 / fine)
    expected = v * np.array([np.cos(yaw).mean(), np.sin(yaw).mean()]) * 3.0
    assert constant_velocity_arc(v, omega)[-1, :2] == pytest.approx(expected, abs=1e-6)


@settings(deadline=None)
@given(v=SPEEDS, omega=st.floats(0, 1e-5))
def test_is_continuous_where_the_yaw_rate_vanishes(v: float, omega: float) -> None:
    found = constant_velocity_arc(v, omega)
    assert found == pytest.approx(constant_velocity_arc(v, 0.0), abs=2e-4)


def test_batches_have_their_shape_in_front() -> None:
    v, omega = np.linspace(-1, 1, 6).reshape(2, 3), np.linspace(0, 2, 6).reshape(2, 3)
    batch = constant_velocity_arc(v, omega, steps=7)
    assert batch.shape == (2, 3, 8, 3)
    assert np.array_equal(batch[1, 2], constant_velocity_arc(v[1, 2], omega[1, 2], steps=7))
