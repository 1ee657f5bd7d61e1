from __future__ import annotations

import cv2
import numpy as np
import pytest

from graspe_data.observation.image_reliability import ImageReliabilitySettings, image_reliability
from model_zoo.augmentation.picture_failure import PictureFailure, retake
from model_zoo.augmentation.settings import ExposureSettings

ROUGH = np.random.default_rng(0).integers(0, 256, (120, 160, 3)).astype(np.uint8)
PICTURE = np.asarray(cv2.GaussianBlur(ROUGH, (0, 0), 0.8), np.uint8)


def taken(
    failure: PictureFailure, seed: int = 0
) -> np.ndarray[tuple[int, ...], np.dtype[np.uint8]]:
    return retake(PICTURE, failure, ExposureSettings(), np.random.default_rng(seed))


def reliability(picture: np.ndarray[tuple[int, ...], np.dtype[np.uint8]]) -> float:
    return image_reliability(picture, ImageReliabilitySettings()).r_img


def test_without_a_failure_the_picture_stays() -> None:
    assert PictureFailure().nothing
    assert np.array_equal(taken(PictureFailure()), PICTURE)


@pytest.mark.parametrize(
    "failure",
    [PictureFailure(light=0.004), PictureFailure(blur_length=20), PictureFailure(covered=0.8)],
)
def test_failures_make_a_picture_less_reliable(failure: PictureFailure) -> None:
    assert not failure.nothing
    assert reliability(taken(failure)) < 0.75 * reliability(PICTURE)


def test_amplification_makes_up_for_some_darkness_not_for_much() -> None:
    means = [taken(PictureFailure(light=light)).mean() for light in (1.0, 0.3, 0.05, 0.002)]
    assert means[1] == pytest.approx(means[0], rel=0.1)
    assert means[1] > means[2] > means[3]
    assert means[3] < 0.2 * means[0]


def test_all_at_once_leave_nearly_black() -> None:
    worst = taken(PictureFailure(light=0.002, blur_length=25, blur_angle=1, covered=1))
    assert worst.mean() < 5


def test_a_black_picture_can_fail_too() -> None:
    black = np.zeros((40, 40, 3), np.uint8)
    failure = PictureFailure(light=0.1, blur_length=5, covered=0.5)
    assert retake(black, failure, ExposureSettings(), np.random.default_rng(0)).mean() < 5
