"""Pictures without distortion, at the dataset's size, with intrinsics that follow."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from graspe_data.arrays import Floats
from graspe_data.errors import ObservationError
from graspe_data.robot import Intrinsics

Maps = tuple[NDArray[np.int16], NDArray[np.uint16]]

# Near a fold a recorded pixel would be drawn out without end; here the view ends at 20 times.
_LEAST_AREA = 0.05
_ZOOMS = np.concatenate((np.linspace(1.0, 2.0, 101), np.linspace(2.01, 4.0, 200)))
_OPENCV = (4, 5, 8, 12, 14)
_COEFFICIENTS = {"plumb_bob": _OPENCV, "rational_polynomial": _OPENCV, "equidistant": (4,)}


@dataclass(frozen=True)
class Rectifier:
    """Brings one camera's pictures to the dataset's size.

    ``source`` and ``intrinsics`` are the calibration of the pictures that go in and come out; the
    latter has no distortion. ``maps``, None where there is nothing to undistort, are OpenCV's
    fixed-point maps of the source's size: int16 (H, W, 2), whole pixels (x, y) of the recorded
    picture, and uint16 (H, W), an index of the fractions, in steps of 1/32 pixel.
    """

    source: Intrinsics
    intrinsics: Intrinsics
    maps: Maps | None

    def apply(self, rgb: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """Undistort a picture, uint8 (H, W, 3), then shrink it by the mean over areas.

        Raises:
            ObservationError: The picture's size is not that of the calibration.
        """
        height, width = rgb.shape[:2]
        if (width, height) != (self.source.width, self.source.height):
            raise ObservationError(
                f"Picture of {width}x{height}, expected {self.source.width}x{self.source.height} "
                "as calibrated: give intrinsics for the pictures as they are recorded."
            )
        flat = rgb if self.maps is None else cv2.remap(rgb, *self.maps, cv2.INTER_LINEAR)
        size = (self.intrinsics.width, self.intrinsics.height)
        shrinks = size[0] <= width and size[1] <= height
        how = cv2.INTER_AREA if shrinks else cv2.INTER_LINEAR
        return np.asarray(cv2.resize(flat, size, interpolation=how), np.uint8)


def rectifier(intrinsics: Intrinsics, size: tuple[int, int] = (320, 240)) -> Rectifier:
    """Make the rectifier of a camera; costs some milliseconds, once a recording.

    Args:
        intrinsics: Of the recorded pictures.
        size: (width, height) of the pictures that come out; both axes are scaled on their own.

    Raises:
        ObservationError: The distortion has a number of coefficients its model does not know, or
            folds back so near the optical axis that no view is left.
    """
    flat, maps = intrinsics, None
    fisheye = intrinsics.distortion_model == "equidistant"
    if fisheye or (intrinsics.distortion_model != "none" and any(intrinsics.distortion)):
        _check_coefficients(intrinsics)
        flat = _undistorted(intrinsics)
        maps = _maps(intrinsics, flat)
    return Rectifier(intrinsics, resized(flat, size), maps)


def resized(intrinsics: Intrinsics, size: tuple[int, int]) -> Intrinsics:
    """Intrinsics of the picture resized to (width, height).

    Pixel centres have whole coordinates, so the picture's corner is at -0.5 and
    cx' = (cx + 0.5) s - 0.5.
    """
    across, down = size[0] / intrinsics.width, size[1] / intrinsics.height
    return intrinsics.model_copy(
        update={
            "width": size[0],
            "height": size[1],
            "fx": intrinsics.fx * across,
            "fy": intrinsics.fy * down,
            "cx": (intrinsics.cx + 0.5) * across - 0.5,
            "cy": (intrinsics.cy + 0.5) * down - 0.5,
        }
    )


def _check_coefficients(intrinsics: Intrinsics) -> None:
    known = _COEFFICIENTS[intrinsics.distortion_model]
    found = len(intrinsics.distortion)
    if found not in known:
        raise ObservationError(
            f"Distortion {intrinsics.distortion_model} with {found} coefficients, expected "
            f"{' or '.join(map(str, known))}: correct the camera's intrinsics."
        )


def _undistorted(source: Intrinsics) -> Intrinsics:
    """The pinhole zoomed in just enough to keep every pixel in the recorded picture.

    Beyond the ray at which the distortion folds back, a polynomial shows the picture once more,
    mirrored. The view ends before it.
    """
    pinhole = source.model_copy(update={"distortion_model": "none", "distortion": ()})
    unfolded = _unfolded(source, pinhole)
    for zoom in _ZOOMS:
        if zoom * unfolded < 1.0:
            continue
        update = {"fx": source.fx * float(zoom), "fy": source.fy * float(zoom)}
        target = pinhole.model_copy(update=update)
        if _covers(source, target):
            return target
    raise ObservationError(
        f"Distortion {source.distortion_model} {list(source.distortion)} cannot be undone: "
        f"{_why_not(source, pinhole, unfolded)}, and zooming in {_ZOOMS[-1]:.0f} times is not "
        f"enough. Calibrate the camera again, as `equidistant` if its lens is wide, and give "
        f"`camera.intrinsics` in the robot manifest."
    )


def _why_not(source: Intrinsics, pinhole: Intrinsics, unfolded: float) -> str:
    if unfolded >= 1.0:
        return f"a view of {source.width}x{source.height} pixels does not lie in the picture"
    nearest = float(np.linalg.norm(_border_rays(pinhole), axis=1).min())
    degrees = float(np.degrees(np.arctan(unfolded * nearest)))
    return f"it folds back {degrees:.1f} degrees or less from the optical axis"


def _covers(source: Intrinsics, target: Intrinsics) -> bool:
    """Tell whether the border of the target's picture lies within the source's."""
    margin = _seen(source, _border_rays(target))[0] + 0.5
    return bool(np.all((margin >= 0) & (margin <= (source.width, source.height))))


def _unfolded(source: Intrinsics, pinhole: Intrinsics) -> float:
    """The share of the way from the axis to the pinhole's border at which nothing folds back.

    Zooming in scales every ray alike, so one share holds for all zooms. The distortion folds where
    the determinant of its derivative (the area that a pixel of the middle has there) comes down to
    zero, or it turns a ray to the other side.
    """
    border = _border_rays(pinhole)
    shares = np.linspace(0.0, 1.0, 401)[1:]
    rays = (border[None] * shares[:, None, None]).reshape(-1, 2)
    pixels, derivative = _seen(source, rays)
    turned = (pixels - (source.cx, source.cy)) / (source.fx, source.fy)
    area = np.linalg.det(derivative) / (source.fx * source.fy)
    sound = (area > _LEAST_AREA) & ((turned * rays).sum(axis=1) > 0)
    folded = np.flatnonzero(~sound.reshape(len(shares), -1).all(axis=1))
    if not folded.size:
        return 1.0
    return float(shares[folded[0] - 1]) if folded[0] else 0.0


def _border_rays(camera: Intrinsics) -> Floats:
    """Rays (x / z, y / z) through the border of a pinhole's picture, (132, 2)."""
    across, down = np.linspace(0, camera.width - 1, 33), np.linspace(0, camera.height - 1, 33)
    border = [(u, v) for u in across for v in (0, camera.height - 1)]
    border += [(u, v) for u in (0, camera.width - 1) for v in down]
    return np.asarray((np.array(border) - (camera.cx, camera.cy)) / (camera.fx, camera.fy))


def _seen(source: Intrinsics, rays: Floats) -> tuple[Floats, Floats]:
    """Pixels (N, 2) at which a camera sees rays, and their derivative by the rays, (N, 2, 2)."""
    coefficients, still = np.asarray(source.distortion, np.float64), np.zeros(3)
    points = np.column_stack((rays, np.ones(len(rays))))
    if source.distortion_model == "equidistant":
        seen, derivative = cv2.fisheye.projectPoints(
            points[:, None], still, still, source.matrix, coefficients
        )
        shift = slice(11, 13)
    else:
        seen, derivative = cv2.projectPoints(points, still, still, source.matrix, coefficients)
        shift = slice(3, 5)
    pixels = np.asarray(seen, np.float64).reshape(-1, 2)
    return pixels, np.asarray(derivative, np.float64)[:, shift].reshape(-1, 2, 2)


def _maps(source: Intrinsics, target: Intrinsics) -> Maps:
    size = (target.width, target.height)
    coefficients = np.asarray(source.distortion, np.float64)
    arguments = (source.matrix, coefficients, np.eye(3), target.matrix, size, cv2.CV_16SC2)
    if source.distortion_model == "equidistant":
        first, second = cv2.fisheye.initUndistortRectifyMap(*arguments)
    else:
        first, second = cv2.initUndistortRectifyMap(*arguments)
    return np.asarray(first, np.int16), np.asarray(second, np.uint16)
