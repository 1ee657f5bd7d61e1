from __future__ import annotations

import numpy as np

from model_zoo.augmentation.light import light_of, picture_of

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
