"""Where the classes of cells lie in the camera's picture."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from graspe_data.geometry import Transform, move_points
from graspe_data.observation.intensity_map import CellClasses, LayerSettings
from graspe_data.observation.intensity_map.grid import cells_of
from graspe_data.robot import Intrinsics
from pipelines.intensity.mapped_clouds import MappedCloud
from pipelines.report.intensity_panels import COLOURS

Picture = NDArray[np.uint8]

NEAREST_M = 0.5
DOT_SHARE = 1 / 900
"""Radius of a dot over the picture's width."""


def draw_classes_in_picture(
    picture: Picture,
    mapped: MappedCloud,
    camera: tuple[Intrinsics, Transform],
    settings: LayerSettings,
    base_height: float,
) -> Picture:
    """Draw a dot for each return in a solid or pliable cell, in the colour of its class.

    Args:
        picture: uint8 (H, W, 3), RGB, of the camera's calibration, taken as without distortion.
        mapped: The cloud and its classes.
        camera: Its calibration, and what carries points of the optical frame into base_link.
        settings: Of the layers: returns outside their heights are not drawn.
        base_height: Of base_link above the ground, metres.
    """
    intrinsics, base_from_camera = camera
    xyz = move_points(mapped.cloud.xyz, mapped.base_from_lidar)
    kinds = _kinds(xyz, mapped, settings, base_height)
    in_camera = move_points(xyz, base_from_camera.inverse())
    ahead = (in_camera[:, 2] > NEAREST_M) & (kinds != "")
    pixels = in_camera[ahead] @ intrinsics.matrix.T
    places = pixels[:, :2] / pixels[:, 2:]
    inside = ((places >= 0) & (places < (intrinsics.width, intrinsics.height))).all(axis=1)
    canvas, radius = picture.copy(), max(1, round(DOT_SHARE * picture.shape[1]))
    for (u, v), kind in zip(places[inside].tolist(), kinds[ahead][inside].tolist(), strict=True):
        colour = [round(255 * part) for part in COLOURS[kind]]
        cv2.circle(canvas, (round(u), round(v)), radius, colour, cv2.FILLED)
    return canvas


def _kinds(
    xyz: NDArray[np.float32], mapped: MappedCloud, settings: LayerSettings, base_height: float
) -> NDArray[np.str_]:
    """The class of each point's cell, (N,); empty off the grid and outside all layers."""
    zero = mapped.base_from_lidar.translation[2] if settings.heights == "lidar" else -base_height
    row, column, inside = cells_of(xyz[:, 0], xyz[:, 1], settings.grid)
    height, kinds = xyz[:, 2] - zero, np.full(len(xyz), "", "<U8")
    in_layers = [(low <= height) & (height < high) for low, high in settings.intervals]
    rows = np.flatnonzero(inside & np.logical_or.reduce(in_layers))
    places = row[rows].astype(np.int64), column[rows].astype(np.int64)
    classes: CellClasses = mapped.planned.classes
    kinds[rows[classes.false_positive[places] > 0]] = "pliable"
    kinds[rows[classes.true_positive[places] > 0]] = "solid"
    return kinds
