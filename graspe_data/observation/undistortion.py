"""Pictures without distortion, at the dataset's size, with intrinsics that follow."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from graspe_data.errors import ObservationError
from graspe_data.robot import Intrinsics

Maps = tuple[NDArray[np.int16], NDArray[np.uint16]]

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
        ObservationError: The distortion has a number of coefficients its model does not know.
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
    """The pinhole zoomed in just enough to keep every pixel in the recorded picture."""
    pinhole = source.model_copy(update={"distortion_model": "none", "distortion": ()})
    for zoom in np.linspace(1.0, 2.0, 101):
        update = {"fx": source.fx * float(zoom), "fy": source.fy * float(zoom)}
        target = pinhole.model_copy(update=update)
        if _covers(source, target):
            return target
    return pinhole


def _covers(source: Intrinsics, target: Intrinsics) -> bool:
    """Tell whether the border of the target's picture lies within the source's."""
    across, down = np.linspace(0, target.width - 1, 33), np.linspace(0, target.height - 1, 33)
    border = [(u, v) for u in across for v in (0, target.height - 1)]
    border += [(u, v) for u in (0, target.width - 1) for v in down]
    rays = (np.array(border) - (target.cx, target.cy)) / (target.fx, target.fy)
    coefficients = np.asarray(source.distortion, np.float64)
    if source.distortion_model == "equidistant":
        seen = cv2.fisheye.distortPoints(rays[:, None], source.matrix, coefficients)
    else:
        depth = np.column_stack((rays, np.ones(len(rays))))
        seen, _ = cv2.projectPoints(depth, np.zeros(3), np.zeros(3), source.matrix, coefficients)
    margin = seen.reshape(-1, 2) + 0.5
    return bool(np.all((margin >= 0) & (margin <= (source.width, source.height))))


def _maps(source: Intrinsics, target: Intrinsics) -> Maps:
    size = (target.width, target.height)
    coefficients = np.asarray(source.distortion, np.float64)
    arguments = (source.matrix, coefficients, np.eye(3), target.matrix, size, cv2.CV_16SC2)
    if source.distortion_model == "equidistant":
        first, second = cv2.fisheye.initUndistortRectifyMap(*arguments)
    else:
        first, second = cv2.initUndistortRectifyMap(*arguments)
    return np.asarray(first, np.int16), np.asarray(second, np.uint16)
