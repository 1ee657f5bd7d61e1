"""Light, motion blur and exposure."""

from __future__ import annotations

import math

import numpy as np
import pytest

from model_zoo.augmentation.camera import expose, light_of, meter, motion_blur, picture_of
from model_zoo.augmentation.settings import ExposureSettings

LEVELS = np.arange(256, dtype=np.uint8)[:, None, None].repeat(3, axis=2)


def test_every_level_comes_back_from_its_light() -> None:
    assert np.array_equal(picture_of(light_of(LEVELS)), LEVELS)


def test_the_curve_is_that_of_srgb() -> None:
    light = light_of(LEVELS)[:, 0, 0]
    assert light[0] == 0
    assert light[255] == 1
    assert abs(light[188] - 0.5029) < 1e-4
    assert abs(light[10] - 10 / 255 / 12.92) < 1e-7


def test_light_beyond_black_and_white_is_clipped() -> None:
    light = np.array([[[-5.0, 1.5, 1e4]]], np.float32)
    assert picture_of(light).tolist() == [[[0, 255, 255]]]


def dot() -> np.ndarray[tuple[int, int, int], np.dtype[np.float32]]:
    light = np.zeros((41, 41, 3), np.float32)
    light[20, 20] = 1
    return light


@pytest.mark.parametrize("angle", [0.0, 0.4, math.pi / 2, 2.5])
@pytest.mark.parametrize("length", [0.5, 3.0, 8.0, 20.0])
def test_a_dot_becomes_a_line_of_the_same_light(length: float, angle: float) -> None:
    line = motion_blur(dot(), length, angle)[..., 0].astype(np.float64)
    v, u = np.indices(line.shape) - 20.0
    assert line.sum() == pytest.approx(1, abs=1e-5)
    assert (line * u).sum() == pytest.approx(0, abs=1e-3)
    assert (line * v).sum() == pytest.approx(0, abs=1e-3)
    along, across = u * math.cos(angle) + v * math.sin(angle), v * math.cos(angle)
    across -= u * math.sin(angle)
    spread = (line * along**2).sum()
    assert spread == pytest.approx(length**2 / 12, abs=0.3)
    assert (line * across**2).sum() < 0.3


def test_an_even_picture_stays() -> None:
    even = np.full((20, 30, 3), 0.4, np.float32)
    assert np.allclose(motion_blur(even, 12, 1.0), even, atol=1e-6)


SENSOR = ExposureSettings(denoising=0)


def even(light: float) -> np.ndarray[tuple[int, int, int], np.dtype[np.float32]]:
    return np.full((200, 200, 3), light, np.float32)


def test_the_exposure_aims_at_the_target_within_its_limits() -> None:
    assert meter(even(0.05), 0.2, 8) == pytest.approx(4)
    assert meter(even(0.001), 0.2, 8) == 8
    assert meter(even(0.5), 0.2, 8) == 1
    assert meter(even(0.0), 0.2, 8) == 8


def test_it_does_not_wash_out_what_is_bright() -> None:
    light = even(0.01)
    light[:20] = 0.5
    assert meter(light, 0.4, 8) == pytest.approx(2)


@pytest.mark.parametrize("light", [0.0005, 0.01, 0.2])
def test_noise_is_that_of_counted_and_read_electrons(light: float) -> None:
    seen = expose(even(light), 4.0, SENSOR, np.random.default_rng(0))
    electrons = light * SENSOR.full_well
    assert seen.mean() == pytest.approx(4 * light, rel=0.02)
    spread = 4 * np.sqrt(electrons + SENSOR.read_noise**2) / SENSOR.full_well
    assert seen.std() == pytest.approx(spread, rel=0.02)


def test_smoothing_takes_noise_away() -> None:
    loud = expose(even(0.01), 8.0, SENSOR, np.random.default_rng(0))
    smooth = expose(even(0.01), 8.0, ExposureSettings(), np.random.default_rng(0))
    assert smooth.std() < 0.4 * loud.std()
