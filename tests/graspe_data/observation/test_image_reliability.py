"""Equations (1) and (2): what harms a picture lowers r_img."""

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from graspe_data.observation.image_reliability import ImageReliabilitySettings, image_reliability

DEFAULT = ImageReliabilitySettings()
UNSATURATED = ImageReliabilitySettings(saturation_corners=5000)
Picture = NDArray[np.uint8]


@pytest.mark.parametrize(("grey", "expected"), [(0, 0.0), (51, 0.2), (255, 1.0)])
def test_brightness_of_an_even_picture_is_its_grey(grey: int, expected: float) -> None:
    found = image_reliability(np.full((240, 320, 3), grey, np.uint8), DEFAULT)
    assert found.r_bright == pytest.approx(expected)
    assert found.r_corners == 0.0
    assert found.r_img == pytest.approx(expected / 2)


def test_brightness_is_the_root_mean_square_grey_value(textured: Picture) -> None:
    gray = cv2.cvtColor(textured, cv2.COLOR_RGB2GRAY).astype(np.float64)
    expected = np.sqrt(np.mean(gray**2)) / 255
    assert image_reliability(textured, DEFAULT).r_bright == pytest.approx(expected)


def test_corners_are_counted_and_saturate() -> None:
    dots = np.zeros((240, 320, 3), np.uint8)
    dots[20:220:20, 20:300:20] = 200
    for saturation, expected in ((280, 0.5), (140, 1.0), (9, 1.0)):
        found = image_reliability(dots, ImageReliabilitySettings(saturation_corners=saturation))
        assert found.r_corners == expected


@pytest.mark.parametrize("height", [1, 6, 7, 40, 41, 44, 47, 80, 87, 240])
def test_corners_are_those_of_the_whole_picture(height: int) -> None:
    noise = np.random.default_rng(height).integers(0, 256, (height, 320), np.uint8)
    gray = cv2.GaussianBlur(noise, (3, 3), 0)
    expected = len(cv2.FastFeatureDetector.create(10).detect(gray))
    settings = ImageReliabilitySettings(saturation_corners=100_000)
    found = image_reliability(np.repeat(gray[:, :, None], 3, axis=2), settings)
    assert found.r_corners == expected / 100_000


@pytest.mark.parametrize("settings", [DEFAULT, UNSATURATED], ids=["default", "unsaturated"])
def test_darkening_lowers_it(textured: Picture, settings: ImageReliabilitySettings) -> None:
    gains = np.linspace(1.0, 0.0, 11)
    values = [image_reliability((textured * g).astype(np.uint8), settings).r_img for g in gains]
    assert np.all(np.diff(values) < 0)
    assert values[-1] == 0


@pytest.mark.parametrize("settings", [DEFAULT, UNSATURATED], ids=["default", "unsaturated"])
def test_blurring_lowers_it(textured: Picture, settings: ImageReliabilitySettings) -> None:
    blurred = [textured] + [cv2.GaussianBlur(textured, (0, 0), s) for s in (1, 2, 4, 8, 16)]
    values = [image_reliability(np.asarray(p, np.uint8), settings).r_img for p in blurred]
    assert np.all(np.diff(values) < 0)


@pytest.mark.parametrize("settings", [DEFAULT, UNSATURATED], ids=["default", "unsaturated"])
def test_covering_lowers_it(textured: Picture, settings: ImageReliabilitySettings) -> None:
    values = []
    for share in np.linspace(0, 1, 9):
        covered = textured.copy()
        covered[:, : round(320 * share)] = 0
        values.append(image_reliability(covered, settings).r_img)
    assert np.all(np.diff(values) < 0)
