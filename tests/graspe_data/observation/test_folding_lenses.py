"""A distortion that folds back within the picture shows no mirrored rim."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from graspe_data.arrays import Floats
from graspe_data.errors import ObservationError
from graspe_data.observation.undistortion import rectifier
from graspe_data.robot import Intrinsics


def camera(
    size: tuple[int, int], matrix: tuple[float, float, float, float], *distortion: float
) -> Intrinsics:
    fx, fy, cx, cy = matrix
    model = "rational_polynomial" if len(distortion) == 8 else "plumb_bob"
    return Intrinsics(
        width=size[0],
        height=size[1],
        fx=fx,
        fy=fy,
        cx=cx,
        cy=cy,
        distortion_model=model,
        distortion=distortion,
    )


# Calibrations with one radial coefficient, as `cameracalibrator --k-coefficients 1` gives, fold at
# 1 + 3 k1 r^2 = 0; the others are like them with more terms.
FOLDING = {
    "k1": camera((640, 480), (300, 300, 320, 240), -0.25, 0, 0, 0, 0),
    "k1 off centre": camera((640, 480), (300, 310, 280, 260), -0.28, 0, 0, 0, 0),
    "k1 in a wide picture": camera((1280, 720), (640, 640, 640, 360), -0.33, 0, 0, 0),
    "k3": camera((640, 480), (320, 320, 320, 240), -0.2, 0.05, 0, 0, -0.05),
    "folds twice": camera((640, 480), (260, 260, 320, 240), -0.36, 0.06, 0, 0, 0),
    "tangential": camera((640, 480), (300, 300, 320, 240), -0.22, 0, 0.02, -0.015, 0),
    "rational": camera((640, 480), (300, 300, 320, 240), -0.3, 0, 0, 0, 0, 0.02, 0, 0),
    "pole": camera((640, 480), (300, 300, 320, 240), 0, 0, 0, 0, 0, -0.6, 0, 0),
    "fisheye": camera((640, 480), (300, 300, 320, 240), -0.3, 0, 0, 0).model_copy(
        update={"distortion_model": "equidistant"}
    ),
}
# EuRoC MAV cam0; Duckietown's default; ROS calibrations of the robots mekabot (PointGrey, 800x600)
# and of a usb_cam, an OAK-D at 1280x800, a front camera at 1920x1080. Before wide lenses were
# looked at, they were zoomed in by these factors.
ORDINARY = [
    (
        camera((752, 480), (458.654, 457.296, 367.215, 248.375), -0.28341, 0.073959, 1.9e-4, 2e-5),
        1.0,
    ),
    (
        camera((640, 480), (305.57, 308.83, 303.07, 231.88), -0.29447, 0.07014, 5.9e-4, -6.7e-4, 0),
        1.0,
    ),
    (camera((800, 600), (538.63, 539.72, 457.7, 297.0), -0.30678, 0.0825, 0.00288, -1.6e-4), 1.0),
    (camera((640, 480), (568.19, 565.76, 355.42, 166.63), -0.513, 0.20375, -1e-4, 0.00126, 0), 1.0),
    (camera((640, 480), (580.47, 576.63, 315.27, 247.47), 0.13446, -0.3119, 0.0023, 0.00308), 1.02),
    (
        camera((640, 480), (722.94, 726.0, 306.51, 263.8), 0.1097, -0.55673, -0.0019, 2.3e-4, 0),
        1.01,
    ),
    (
        camera((1280, 800), (415.13, 410.5, 665.52, 460.15), -0.0177, -0.00727, 0.00575, -1.4e-4),
        1.0,
    ),
    (camera((1920, 1080), (987.14, 979.95, 976.47, 581.69), -0.28624, 0.06145, -8e-4, -1e-3), 1.0),
]


def seen(source: Intrinsics, rays: Floats) -> Floats:
    """OpenCV's own projection of rays (x / z, y / z)."""
    points, still = np.column_stack((rays, np.ones(len(rays))))[:, None], np.zeros(3)
    distortion = np.array(source.distortion)
    if source.distortion_model == "equidistant":
        pixels, _ = cv2.fisheye.projectPoints(points, still, still, source.matrix, distortion)
    else:
        pixels, _ = cv2.projectPoints(points, still, still, source.matrix, distortion)
    return np.asarray(pixels, np.float64).reshape(-1, 2)


def view(source: Intrinsics) -> Intrinsics:
    """The undistorted camera at the size of the recorded pictures."""
    return rectifier(source, (source.width, source.height)).intrinsics


def rays_of(target: Intrinsics, step: int) -> Floats:
    rows, columns = np.mgrid[: target.height : step, : target.width : step]
    pixels = np.stack((columns, rows), axis=-1).reshape(-1, 2)
    return np.asarray((pixels - (target.cx, target.cy)) / (target.fx, target.fy))


@pytest.mark.parametrize("source", FOLDING.values(), ids=list(FOLDING))
def test_along_every_ray_from_the_middle_the_picture_goes_outwards(source: Intrinsics) -> None:
    rays = rays_of(view(source), 20)
    shares = np.linspace(0.02, 1, 50)
    middle = (source.cx, source.cy)
    out = np.stack(
        [np.linalg.norm(seen(source, rays * share) - middle, axis=1) for share in shares]
    )
    far = np.linalg.norm(rays, axis=1) > 0.05
    assert (np.diff(out, axis=0)[:, far] > 0).all()


@pytest.mark.parametrize("source", FOLDING.values(), ids=list(FOLDING))
def test_every_pixel_shows_the_recorded_picture(source: Intrinsics) -> None:
    pixels = seen(source, rays_of(view(source), 10)) + 0.5
    assert (pixels >= -1e-6).all()
    assert (pixels <= (source.width + 1e-6, source.height + 1e-6)).all()


@pytest.mark.parametrize("source", FOLDING.values(), ids=list(FOLDING))
def test_a_drawn_grid_is_found_once_where_its_rays_are(source: Intrinsics) -> None:
    prepared = rectifier(source, (source.width, source.height))
    target = prepared.intrinsics
    for u, v in [(0.04, 0.04), (0.96, 0.06), (0.5, 0.5), (0.05, 0.94), (0.97, 0.95), (0.03, 0.5)]:
        drawn = np.array([u * target.width, v * target.height])
        ray = (drawn - (target.cx, target.cy)) / (target.fx, target.fy)
        at = seen(source, ray[None])[0]
        recorded = np.zeros((source.height, source.width, 3), np.uint8)
        cv2.circle(recorded, (round(at[0] * 16), round(at[1] * 16)), 32, (255,) * 3, -1, shift=4)
        rows, columns = np.nonzero(prepared.apply(recorded)[..., 0] > 100)
        assert rows.size
        assert np.abs(columns - drawn[0]).max() < 25
        assert np.abs(rows - drawn[1]).max() < 25


def test_no_more_is_cut_than_folds() -> None:
    source = FOLDING["k1"]
    fold = np.sqrt(1 / (3 * 0.25))
    corner = np.hypot(320 / 300, 240 / 300)
    assert view(source).fx / source.fx == pytest.approx(corner / fold, rel=0.05)


@pytest.mark.parametrize(("source", "zoom"), ORDINARY)
def test_ordinary_lenses_are_undistorted_as_before(source: Intrinsics, zoom: float) -> None:
    prepared = rectifier(source, (source.width, source.height))
    assert prepared.intrinsics.fx / source.fx == pytest.approx(zoom, abs=1e-9)
    size, flat = (source.width, source.height), prepared.intrinsics.matrix
    distortion = np.array(source.distortion)
    expected = cv2.initUndistortRectifyMap(
        source.matrix, distortion, np.eye(3), flat, size, cv2.CV_16SC2
    )
    assert prepared.maps is not None
    assert all(np.array_equal(*pair) for pair in zip(prepared.maps, expected, strict=True))


@pytest.mark.parametrize(
    ("distortion", "fault"),
    [
        ((-10.0, 0.0, 0.0, 0.0, 0.0), r"folds back [56]\.\d degrees or less from the optical axis"),
        ((-500.0, 0.0, 0.0, 0.0), "as `equidistant` if its lens is wide"),
        ((0.0, 0.0, 0.9, 0.9, 0.0), "folds back"),
    ],
)
def test_a_distortion_that_folds_near_the_middle_is_refused(
    distortion: tuple[float, ...], fault: str
) -> None:
    with pytest.raises(ObservationError, match=fault):
        rectifier(camera((640, 480), (500, 500, 320, 240), *distortion))


def test_a_centre_outside_the_picture_is_refused() -> None:
    with pytest.raises(ObservationError, match="does not lie in the picture"):
        rectifier(camera((640, 480), (500, 500, 900, 240), 0.4, 0, 0, 0, 0))
