"""The exposure reaches its target where its limits allow."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from graspe_data.simulation.camera.exposure import electrons_per_second, meter
from graspe_data.simulation.camera.settings import CameraSettings

SETTINGS = CameraSettings()
WHITE_PER_SECOND = electrons_per_second(SETTINGS) / SETTINGS.full_well


def even(luminance: float) -> NDArray[np.float32]:
    return np.full((48, 64, 3), luminance, np.float32)


def test_the_sensors_illuminance_is_that_of_the_camera_equation() -> None:
    settings = CameraSettings(f_number=4.0, sensitivity=1000.0)
    assert electrons_per_second(settings) == pytest.approx(1000.0 * np.pi / 64.0)


@given(st.floats(1e-3, 1e5))
def test_an_even_picture_becomes_grey_until_the_limits(luminance: float) -> None:
    found = meter(even(luminance), SETTINGS)
    grey = luminance * WHITE_PER_SECOND * found.time_s * found.gain
    longest = luminance * WHITE_PER_SECOND * SETTINGS.exposure_limit * SETTINGS.gain_limit
    assert grey == pytest.approx(min(SETTINGS.target_grey, longest), rel=1e-3)
    assert found.time_s <= SETTINGS.exposure_limit
    assert 1.0 <= found.gain <= SETTINGS.gain_limit * (1 + 1e-9)


@given(st.floats(1e-3, 1e5))
def test_time_is_spent_before_gain(luminance: float) -> None:
    found = meter(even(luminance), SETTINGS)
    assert found.gain == 1.0 or found.time_s == SETTINGS.exposure_limit


def test_at_night_both_limits_are_reached() -> None:
    found = meter(even(0.02), SETTINGS)
    assert found.time_s == SETTINGS.exposure_limit
    assert found.gain == pytest.approx(SETTINGS.gain_limit)


def test_darkness_is_exposed_as_long_as_may_be() -> None:
    found = meter(even(0.0), SETTINGS)
    assert (found.time_s, found.gain) == (SETTINGS.exposure_limit, SETTINGS.gain_limit)


def test_a_bright_part_larger_than_the_highlights_is_kept_below_white() -> None:
    scene = even(100.0)
    scene[:, :16] = 5000.0
    found = meter(scene, SETTINGS)
    assert 5000.0 * WHITE_PER_SECOND * found.time_s == pytest.approx(
        min(1.0, SETTINGS.target_grey / (0.25 + 0.75 / 50)), rel=1e-3
    )
    careless = meter(scene, CameraSettings(target_grey=0.5, highlights=0.5))
    careful = meter(scene, CameraSettings(target_grey=0.5))
    assert careful.time_s * 5000.0 * WHITE_PER_SECOND == pytest.approx(1.0, rel=1e-3)
    assert careless.time_s > 5 * careful.time_s
