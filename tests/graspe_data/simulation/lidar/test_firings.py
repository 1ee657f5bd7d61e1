"""The firing pattern of a VLP-16, against its manual."""

from __future__ import annotations

import numpy as np
import pytest

from graspe_data.simulation.lidar.beams import firings_of_turn


@pytest.mark.parametrize(("rate", "columns"), [(5.0, 3616), (10.0, 1808), (20.0, 904)])
def test_a_turn_has_every_whole_column(rate: float, columns: int) -> None:
    firings = firings_of_turn(rate)
    assert len(firings.time_s) == len(firings.direction) == 16 * columns
    assert 0 == firings.time_s[0] < firings.time_s[-1] < 1 / rate


def test_lasers_fire_every_2_304_us_and_columns_every_55_296_us() -> None:
    time_s = firings_of_turn(10.0).time_s.reshape(-1, 16)
    np.testing.assert_allclose(np.diff(time_s, axis=1), 2.304e-6, rtol=1e-6)
    np.testing.assert_allclose(np.diff(time_s[:, 0]), 55.296e-6, rtol=1e-6)


def test_the_lasers_of_both_halves_take_turns() -> None:
    firings = firings_of_turn(10.0)
    assert firings.ring[:16].tolist() == [0, 8, 1, 9, 2, 10, 3, 11, 4, 12, 5, 13, 6, 14, 7, 15]
    elevation = np.degrees(np.arcsin(firings.direction[:16, 2]))
    expected = [-15, 1, -13, 3, -11, 5, -9, 7, -7, 9, -5, 11, -3, 13, -1, 15]
    np.testing.assert_allclose(elevation, expected, atol=1e-9)


def test_the_sensor_turns_clockwise_from_behind_at_an_even_rate() -> None:
    firings = firings_of_turn(10.0)
    np.testing.assert_allclose(firings.azimuth, np.pi - 20 * np.pi * firings.time_s)
    seen = np.unwrap(np.arctan2(firings.direction[:, 1], firings.direction[:, 0]))
    np.testing.assert_allclose(seen, firings.azimuth, atol=1e-9)


def test_directions_are_unit_vectors() -> None:
    np.testing.assert_allclose(np.linalg.norm(firings_of_turn(10.0).direction, axis=1), 1.0)
