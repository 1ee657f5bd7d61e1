"""Noise, gain and curve of the sensor."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from graspe_data.simulation.camera.develop import count_electrons, develop
from graspe_data.simulation.camera.exposure import Exposure, electrons_per_second
from graspe_data.simulation.camera.settings import CameraSettings

SIDE = 200
SILENT = CameraSettings(sensitivity=1e6, full_well=1e6, read_noise=0.0, denoising=0.0)


@settings(max_examples=30, deadline=None)
@given(st.floats(0.5, 3000.0), st.integers(0, 99))
def test_shot_noise_has_the_variance_of_the_signal(mean: float, seed: int) -> None:
    still = CameraSettings(read_noise=0.0)
    even = np.full((SIDE, SIDE, 1), mean, np.float32)
    counted = count_electrons(even, still, np.random.default_rng(seed)).astype(np.float64)
    # Of n pixels: the mean is off by sqrt(m / n), the variance by about m sqrt((2 + 1 / m) / n).
    assert counted.mean() == pytest.approx(mean, abs=5 * np.sqrt(mean / SIDE**2))
    assert counted.var() == pytest.approx(mean, rel=5 * np.sqrt(2 + 1 / mean) / SIDE)


@pytest.mark.parametrize("mean", [0.0, 10.0, 500.0])
def test_reading_adds_its_own_variance(mean: float) -> None:
    even = np.full((SIDE, SIDE, 1), mean, np.float32)
    noisy = CameraSettings(read_noise=6.0)
    counted = count_electrons(even, noisy, np.random.default_rng(1))
    assert counted.var() == pytest.approx(mean + 36.0, rel=0.05)


def test_a_full_well_holds_no_more() -> None:
    bright = np.full((8, 8, 3), 1e9, np.float32)
    assert count_electrons(bright, CameraSettings(), np.random.default_rng(0)).max() == 10_000.0


@pytest.mark.parametrize(
    ("linear", "code"), [(0.0, 0), (0.002, 7), (0.18, 118), (0.5, 188), (1, 255)]
)
def test_known_greys_have_the_codes_of_srgb(linear: float, code: int) -> None:
    luminance = linear * SILENT.full_well / electrons_per_second(SILENT)
    even = np.full((32, 32, 3), luminance, np.float32)
    picture = develop(even, Exposure(1.0, 1.0), SILENT, np.random.default_rng(0))
    assert np.median(picture) == code


def test_gain_and_time_scale_the_signal_alike() -> None:
    even = np.full((64, 64, 3), 2.0, np.float32)
    rough = CameraSettings(denoising=0.0)
    long, loud = (
        develop(even, exposure, rough, np.random.default_rng(0))
        for exposure in (Exposure(1.0, 1.0), Exposure(0.25, 4.0))
    )
    assert np.median(long) == np.median(loud)
    assert loud.std() > 1.5 * long.std()


def test_smoothing_that_grows_with_the_gain_lowers_the_noise() -> None:
    even = np.full((64, 64, 3), 0.1, np.float32)
    spreads = [
        develop(
            even, Exposure(0.03, 8.0), CameraSettings(denoising=sigma), np.random.default_rng(0)
        ).std()
        for sigma in (0.0, 0.2, 0.4)
    ]
    assert spreads[0] > 1.5 * spreads[1] > 2 * spreads[2]
