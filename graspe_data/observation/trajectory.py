"""The trajectory of a velocity: its arc, and the arc drawn into the picture on the ground."""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import ArrayLike, NDArray

from graspe_data.arrays import Floats
from graspe_data.geometry import Transform
from graspe_data.robot import Intrinsics


def constant_velocity_arc(
    v: ArrayLike, omega: ArrayLike, steps: int = 10, step: float = 0.3
) -> NDArray[np.float64]:
    """Poses along the arc of a constant velocity, exact for every yaw rate, 0 included.

    The chord after time t has length v t sinc(omega t / 2) and direction omega t / 2.

    Args:
        v: Linear velocity (...), m/s; negative drives backwards.
        omega: Yaw rate (...), rad/s.
        steps: Poses after the first.
        step: Time between poses, s.

    Returns:
        float64 (..., steps + 1, 3): x, y in metres and yaw in rad, not wrapped, in base_link at
        the start; the first pose is 0.
    """
    times = np.arange(steps + 1) * step
    half_turn = np.multiply.outer(np.asarray(omega, np.float64), times) / 2
    length = np.multiply.outer(np.asarray(v, np.float64), times)
    chord = length * np.sinc(half_turn / np.pi)
    pose = (chord * np.cos(half_turn), chord * np.sin(half_turn), 2 * half_turn)
    return np.stack(np.broadcast_arrays(*pose), axis=-1)


_FRACTION_BITS = 8


def ground_homography(
    intrinsics: Intrinsics, base_from_camera: Transform, base_height: float
) -> Floats:
    """The homography from the ground to the picture.

    Args:
        intrinsics: Of the picture, without distortion.
        base_from_camera: Carries points of the optical frame into base_link.
        base_height: The ground is the plane z = -base_height of base_link, metres.

    Returns:
        (3, 3): takes (x, y, 1) of a point on the ground in base_link, metres, to depth times
        (u, v, 1) in pixels; a depth that is not positive lies behind the camera.
    """
    camera = base_from_camera.inverse()
    lowered = camera.translation - base_height * camera.rotation[:, 2]
    columns = np.column_stack((camera.rotation[:, :2], lowered))
    return np.asarray(intrinsics.matrix @ columns, np.float64)


def trajectory_image(
    arc: Floats,
    intrinsics: Intrinsics,
    base_from_camera: Transform,
    base_height: float,
    line_width: float,
) -> NDArray[np.bool_]:
    """Draw a trajectory as a ribbon on the ground.

    The ribbon's parts are clipped by the pyramid of what the camera sees, with a margin, before
    they are divided by their depth: nothing behind the camera comes round to the front.

    Args:
        arc: Poses (M, 3): x, y in metres and yaw in rad, base_link; the ribbon is straight
            between them, so give it finer than the horizon's steps.
        intrinsics: Of the picture, without distortion; also its size.
        base_from_camera: Carries points of the optical frame into base_link.
        base_height: Height of base_link above the ground, metres.
        line_width: Width of the ribbon, metres.

    Returns:
        bool (H, W): True on the ribbon, to half a pixel; all False where it is not in the picture.
    """
    canvas = np.zeros((intrinsics.height, intrinsics.width), np.uint8)
    to_pixels = ground_homography(intrinsics, base_from_camera, base_height)
    planes = _clip_planes(intrinsics.width, intrinsics.height)
    # The ribbon on the ground, as homogeneous pixels (P, 4, 3).
    parts = _ribbon(arc, line_width) @ to_pixels.T
    # Parts that lie beyond one edge of the view are hidden; those across an edge are clipped.
    outside: NDArray[np.bool_] = parts @ planes.T < 0
    hidden = np.any(np.all(outside, axis=1), axis=1)
    crossing = np.any(outside, axis=(1, 2))
    for part, crosses in zip(parts[~hidden], crossing[~hidden], strict=True):
        visible = _clipped(part, planes) if crosses else part
        _fill(canvas, visible[visible[:, 2] > 0])
    return canvas.view(np.bool_)


def _ribbon(arc: Floats, width: float) -> Floats:
    """The ribbon's parts (M - 1, 4, 3): corners (x, y, 1) on the ground."""
    x, y, yaw = arc.T
    aside = np.stack((-np.sin(yaw), np.cos(yaw), np.zeros_like(yaw)), axis=-1) * (width / 2)
    centre = np.stack((x, y, np.ones_like(x)), axis=-1)
    left, right = centre + aside, centre - aside
    return np.stack((left[:-1], left[1:], right[1:], right[:-1]), axis=1)


def _clip_planes(width: int, height: int) -> Floats:
    """The pyramid over the picture and its size all around: half-spaces (4, 3) of (u, v, 1)."""
    left, right = (1.0, 0.0, width), (-1.0, 0.0, 2.0 * width)
    above, below = (0.0, 1.0, height), (0.0, -1.0, 2.0 * height)
    return np.array((left, right, above, below))


def _clipped(polygon: Floats, planes: Floats) -> Floats:
    """The part of a convex polygon (K, 3) within all half-spaces (Sutherland-Hodgman)."""
    for plane in planes:
        polygon = _cut(polygon, polygon @ plane)
    return polygon


def _cut(polygon: Floats, inside: Floats) -> Floats:
    corners = []
    for here in range(len(polygon)):
        before = here - 1
        if inside[here] * inside[before] < 0:
            share = inside[before] / (inside[before] - inside[here])
            corners.append(polygon[before] + share * (polygon[here] - polygon[before]))
        if inside[here] >= 0:
            corners.append(polygon[here])
    return np.array(corners).reshape(-1, 3)


def _fill(canvas: NDArray[np.uint8], polygon: Floats) -> None:
    if len(polygon) == 0:
        return
    pixels = polygon[:, :2] / polygon[:, 2:]
    corners = np.rint(pixels * (1 << _FRACTION_BITS)).astype(np.int32)
    cv2.fillConvexPoly(canvas, corners, 1, cv2.LINE_8, _FRACTION_BITS)


LARGEST_TURN = 0.05


@dataclass(frozen=True)
class PredictedTrajectory:
    """One robot's camera and horizon, ready to draw any velocity.

    ``intrinsics`` are those of the stored picture, ``base_height``, ``line_width`` and ``behind``
    metres, ``step_s`` seconds. It is drawn as a camera sees it that stands ``behind`` metres behind
    the robot's own, at the same height and pitch: a camera on a robot does not see the ground
    before its feet, and slow arcs end there.
    """

    intrinsics: Intrinsics
    base_from_camera: Transform
    base_height: float
    line_width: float
    steps: int = 10
    step_s: float = 0.3
    behind: float = 0.0

    def draw(self, v: float, omega: float) -> NDArray[np.bool_]:
        """The trajectory image, bool (H, W), of a velocity in m/s and rad/s.

        The arc is drawn in straight parts that each turn by 0.05 rad at most: at a radius of 10 m
        they leave the arc by 3 mm.
        """
        parts = max(1, math.ceil(abs(omega) * self.step_s / LARGEST_TURN))
        arc = constant_velocity_arc(v, omega, self.steps * parts, self.step_s / parts)
        mounting = self.base_from_camera
        place = mounting.translation - np.array((self.behind, 0.0, 0.0))
        return trajectory_image(
            arc,
            self.intrinsics,
            Transform(mounting.rotation, place),
            self.base_height,
            self.line_width,
        )
