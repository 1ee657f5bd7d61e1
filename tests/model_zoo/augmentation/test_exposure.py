from __future__ import annotations

import numpy as np
import pytest

from model_zoo.augmentation.exposure import expose, meter
from model_zoo.augmentation.settings import SensorSettings

SENSOR = SensorSettings(denoising=0)


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
    smooth = expose(even(0.01), 8.0, SensorSettings(), np.random.default_rng(0))
    assert smooth.std() < 0.4 * loud.std()
