"""What fails of a lidar, and the returns that are left."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from graspe_data.arrays import Floats32
from graspe_data.observation.laser_scan import LaserScanSettings

_NEAREST, _FARTHEST = 0.1, 0.9
"""Shares of the way at which scattered returns come back."""


@dataclass(frozen=True)
class LidarFailure:
    """What happens to the lidar of one row; as made without arguments, nothing.

    Attributes:
        sector_middle: Azimuth, rad, of the middle of the sector that is lost.
        sector_width: Its width, rad; 2 pi or more loses all.
        thinned: Share of the returns that are lost here and there.
        scattered: Share of the returns that come from nearer.
    """

    sector_middle: float = 0.0
    sector_width: float = 0.0
    thinned: float = 0.0
    scattered: float = 0.0

    @property
    def nothing(self) -> bool:
        """The returns stay as they are."""
        return self.sector_width == 0.0 and self.thinned == 0.0 and self.scattered == 0.0


def lose_points(
    xyz: Floats32, failure: LidarFailure, generator: np.random.Generator
) -> tuple[NDArray[np.intp], Floats32]:
    """Choose the points that are left, and where on their way they come from.

    Args:
        xyz: float32 (N, 3), metres, base_link.
        failure: What happens.
        generator: Draws which.

    Returns:
        Indices of the points left, ascending, and float32 as many: the share of the way to each
        at which it comes back, 1 where it is not scattered.
    """
    left, way = _fate(len(xyz), failure, generator)
    left &= ~_in_sector(xyz[:, 0], xyz[:, 1], failure)
    index = np.flatnonzero(left)
    return index, way[index]


def lose_rays(
    scan: Floats32,
    failure: LidarFailure,
    settings: LaserScanSettings,
    generator: np.random.Generator,
) -> Floats32:
    """The scan of a failing lidar, float32 (rays,), inf where empty.

    A ray stands for its nearest return: it is lost or scattered as often as a return. What is
    scattered to below the least range of the scan does not show there.

    Args:
        scan: float32 (rays,), metres, from right to left.
        failure: What happens.
        settings: The angle that it covers and its least range.
        generator: Draws which.
    """
    # Rays lie at the middles of equal steps of azimuth, from right to left.
    left, way = _fate(len(scan), failure, generator)
    step = 2 * settings.half_angle / len(scan)
    azimuth = (np.arange(len(scan)) + 0.5) * step - settings.half_angle
    left &= ~_in_sector(np.cos(azimuth), np.sin(azimuth), failure)
    nearer = scan * way
    shown = np.where(nearer >= settings.minimum_range, nearer, scan)
    return np.where(left, shown, np.float32(np.inf))


def scattered_smoothness(smoothness: Floats32, way: Floats32) -> Floats32:
    """The smoothness c of points of which some are scattered.

    Equation (3) for X_l = w X among neighbours at X: c = |w X - X| / |w X| = 1 / w - 1.

    Args:
        smoothness: float32 (N,), as they were.
        way: float32 (N,), w; 1 where they are not scattered.
    """
    return np.where(way < 1, 1 / way - 1, smoothness)


def _fate(
    number: int, failure: LidarFailure, generator: np.random.Generator
) -> tuple[NDArray[np.bool_], Floats32]:
    """Which of so many returns are left of thinning, and the share of the way of each."""
    if failure.thinned == failure.scattered == 0.0:
        return np.ones(number, np.bool_), np.ones(number, np.float32)
    # Three draws a return: whether it is lost, whether it is scattered, and how near it then is.
    lost, nearer, where = generator.random((3, number), np.float32)
    way = np.float32(_NEAREST) + where * np.float32(_FARTHEST - _NEAREST)
    return lost >= failure.thinned, np.where(nearer < failure.scattered, way, np.float32(1))


def _in_sector(
    x: NDArray[np.floating], y: NDArray[np.floating], failure: LidarFailure
) -> NDArray[np.bool_]:
    if failure.sector_width >= 2 * math.pi:
        return np.ones(len(x), np.bool_)
    if failure.sector_width <= 0:
        return np.zeros(len(x), np.bool_)
    # Within the sector is who lies no more than half its width off its middle: by the cosine of
    # that angle, without computing it.
    towards = x * math.cos(failure.sector_middle) + y * math.sin(failure.sector_middle)
    within: NDArray[np.bool_] = towards > math.cos(failure.sector_width / 2) * np.hypot(x, y)
    return within
