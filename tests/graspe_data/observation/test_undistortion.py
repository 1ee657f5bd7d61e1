"""Pictures are resized and undistorted, and their intrinsics follow."""

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from graspe_data.errors import ObservationError
from graspe_data.observation.undistortion import rectifier, resized
from graspe_data.robot import Intrinsics

KITTI = Intrinsics(width=1242, height=375, fx=721.54, fy=721.54, cx=609.56, cy=172.85)
DISTORTED = Intrinsics(
    width=640,
    height=480,
    fx=500.0,
    fy=510.0,
    cx=320.0,
    cy=236.0,
    distortion_model="plumb_bob",
    distortion=(-0.2, 0.05, 0.001, -0.002, 0.0),
)
FISHEYE = DISTORTED.model_copy(
    update={"distortion_model": "equidistant", "distortion": (0.02, -0.01, 0.0, 0.0)}
)
PINCUSHION = DISTORTED.model_copy(update={"distortion": (0.15, 0.0, 0.0, 0.0, 0.0)})


def _spot(size: tuple[int, int], centre: NDArray[np.float64], spread: float) -> NDArray[np.uint8]:
    rows, columns = np.mgrid[: size[1], : size[0]]
    distance = (columns - centre[0]) ** 2 + (rows - centre[1]) ** 2
    grey = np.rint(250 * np.exp(-distance / (2 * spread**2))).astype(np.uint8)
    return np.repeat(grey[..., None], 3, axis=-1)


def _middle(rgb: NDArray[np.uint8]) -> NDArray[np.float64]:
    grey = rgb[..., 0].astype(np.float64)
    rows, columns = np.mgrid[: grey.shape[0], : grey.shape[1]]
    weighted = ((columns * grey).sum() / grey.sum(), (rows * grey).sum() / grey.sum())
    return np.array(weighted, np.float64)


def _seen(ray: tuple[float, float, float], camera: Intrinsics) -> NDArray[np.float64]:
    """Pixel of a ray through a camera and its distortion."""
    coefficients = np.array(camera.distortion or (0.0,) * 4)
    point = np.array([[ray]])
    if camera.distortion_model == "equidistant":
        pixels, _ = cv2.fisheye.projectPoints(
            point, np.zeros(3), np.zeros(3), camera.matrix, coefficients
        )
    else:
        pixels, _ = cv2.projectPoints(point, np.zeros(3), np.zeros(3), camera.matrix, coefficients)
    return np.asarray(pixels, np.float64).reshape(2)


@pytest.mark.parametrize(
    "camera",
    [KITTI, DISTORTED, FISHEYE, PINCUSHION],
    ids=["none", "barrel", "fisheye", "pincushion"],
)
@pytest.mark.parametrize("ray", [(0.0, 0.0, 1.0), (0.3, 0.1, 1.0), (-0.35, -0.12, 1.0)])
def test_a_spot_is_found_where_the_new_intrinsics_say(
    camera: Intrinsics, ray: tuple[float, float, float]
) -> None:
    recorded = _spot((camera.width, camera.height), _seen(ray, camera), spread=6)
    prepared = rectifier(camera)
    picture = prepared.apply(recorded)
    assert picture.shape == (240, 320, 3)
    assert prepared.intrinsics.distortion_model == "none"
    assert _middle(picture) == pytest.approx(_seen(ray, prepared.intrinsics), abs=0.15)


def test_pixel_centres_are_whole_numbers() -> None:
    half = resized(Intrinsics(width=4, height=4, fx=8, fy=8, cx=1.5, cy=0.5), (2, 2))
    assert (half.fx, half.fy, half.cx, half.cy) == (4, 4, 0.5, 0.0)
    picture = np.zeros((4, 4, 3), np.uint8)
    picture[:2, :2] = 100
    assert rectifier(Intrinsics(width=4, height=4, fx=8, fy=8, cx=1.5, cy=0.5), (2, 2)).apply(
        picture
    )[..., 0].tolist() == [[100, 0], [0, 0]]


def test_shrinking_does_not_alias() -> None:
    stripes = np.zeros((480, 640, 3), np.uint8)
    stripes[:, ::2] = 200
    plain = DISTORTED.model_copy(update={"distortion_model": "none", "distortion": ()})
    for camera in (plain, DISTORTED):
        picture = rectifier(camera).apply(stripes)[20:-20, 20:-20]
        assert picture.mean() == pytest.approx(100, abs=2)
        assert picture.std() < 12


def test_no_pixel_is_invented() -> None:
    white = np.full((480, 640, 3), 255, np.uint8)
    for camera in (DISTORTED, FISHEYE, PINCUSHION):
        assert rectifier(camera).apply(white).min() >= 254
    assert rectifier(PINCUSHION).intrinsics.fx > 250
    assert rectifier(DISTORTED).intrinsics.fx == pytest.approx(250)


def test_a_calibration_of_zeros_is_none() -> None:
    zeros = DISTORTED.model_copy(update={"distortion": (0.0,) * 5})
    assert rectifier(zeros).maps is None


def test_a_picture_of_the_right_size_stays_as_it_is(textured: NDArray[np.uint8]) -> None:
    same = Intrinsics(width=320, height=240, fx=250, fy=250, cx=160, cy=120)
    assert np.array_equal(rectifier(same).apply(textured), textured)


def test_faults_are_named() -> None:
    with pytest.raises(ObservationError, match="640x480, expected 1242x375"):
        rectifier(KITTI).apply(np.zeros((480, 640, 3), np.uint8))
    short = DISTORTED.model_copy(update={"distortion": (0.1, 0.2, 0.3)})
    with pytest.raises(ObservationError, match="3 coefficients, expected 4 or 5"):
        rectifier(short)
