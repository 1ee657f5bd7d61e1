from __future__ import annotations

import math

import numpy as np
import pytest

from model_zoo.augmentation.blur import motion_blur


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
