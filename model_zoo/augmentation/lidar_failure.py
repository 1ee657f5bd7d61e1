"""What fails of a lidar, and the returns that are left."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from graspe_data.arrays import Floats32
from graspe_data.observation.laser_scan import LaserScanSettings
from graspe_data.sensor_failures import Dust, MetReturns, NearLeaves, meet_dust, meet_leaves

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
        dust: Strength of dust or rain on the way, 0..1.
        near_leaves: Share of what is ahead that leaves right before the lidar hide, 0..1.
    """

    sector_middle: float = 0.0
    sector_width: float = 0.0
    thinned: float = 0.0
    scattered: float = 0.0
    dust: float = 0.0
    near_leaves: float = 0.0

    @property
    def nothing(self) -> bool:
        """The returns stay as they are."""
        return self == LidarFailure(self.sector_middle)


@dataclass(frozen=True)
class ReturnsLeft:
    """What is left of the returns of a cloud.

    Attributes:
        index: Of those left, ascending, (L,).
        way: Share of the way to each at which it comes back, float32 (L,); 1 where nothing is met.
        brightness: By how much its intensity changes, float32 (L,).
        roughness: Of what it met together with its neighbours, float32 (L,); 0 where it met
            nothing, or something alone.
    """

    index: NDArray[np.intp]
    way: Floats32
    brightness: Floats32
    roughness: Floats32


def lose_points(
    xyz: Floats32, failure: LidarFailure, generator: np.random.Generator
) -> ReturnsLeft:
    """Choose the points that are left, and where on their way they come from.

    Args:
        xyz: float32 (N, 3), metres, base_link.
        failure: What happens.
        generator: Draws which.

    Ways count from base_link, some decimetres from the lidar.
    """
    left, way = _fate(len(xyz), failure, generator)
    bright, rough = np.ones(len(xyz), np.float32), np.zeros(len(xyz), np.float32)
    for met, there in _met(xyz, failure, generator):
        way = np.where(met.met, np.minimum(way, met.distance / there), way)
        bright *= met.brightness
        rough = np.maximum(rough, met.roughness)
    left &= ~_in_sector(xyz[:, 0], xyz[:, 1], failure)
    index = np.flatnonzero(left)
    return ReturnsLeft(index, way[index], bright[index], rough[index])


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
    across = np.stack([np.cos(azimuth), np.sin(azimuth), np.zeros(len(scan))], axis=1)
    left &= ~_in_sector(across[:, 0], across[:, 1], failure)
    nearer = scan * way
    for met, _ in _met(across.astype(np.float32), failure, generator, scan):
        nearer = np.where(met.met, np.minimum(nearer, met.distance), nearer)
    shown = np.where(nearer >= settings.minimum_range, nearer, scan)
    return np.where(left, shown, np.float32(np.inf))


def scattered_smoothness(
    smoothness: Floats32, left: ReturnsLeft, generator: np.random.Generator
) -> Floats32:
    """The smoothness c of the points left, of which some come from nearer.

    Equation (3) for X_l = w X among ten neighbours at X: c = |w X - X| / |w X| = 1 / w - 1. Where
    the neighbours met the same thing, at distances that differ by a share s, c is the absolute
    value of a normal number of deviation s sqrt(1 + 1 / 10).

    Args:
        smoothness: float32 (L,), as they were.
        left: Where they come from now.
        generator: Draws the normal numbers.
    """
    alone = np.where(left.way < 1, 1 / left.way - 1, smoothness)
    if not left.roughness.any():
        return alone
    drawn = np.abs(generator.standard_normal(len(smoothness), np.float32))
    together = drawn * left.roughness * np.float32(1.1**0.5)
    return np.where(left.roughness > 0, together, alone)


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


def _met(
    direction: Floats32,
    failure: LidarFailure,
    generator: np.random.Generator,
    there: Floats32 | None = None,
) -> Iterator[tuple[MetReturns, Floats32]]:
    """What beams meet of dust and leaves, and how far they went without."""
    if failure.dust == failure.near_leaves == 0.0:
        return
    distance = np.linalg.norm(direction, axis=1) if there is None else there
    seeds = generator.integers(2**31, size=2).tolist()
    if failure.dust > 0:
        yield meet_dust(direction, distance, Dust(failure.dust, seeds[0])), distance
    if failure.near_leaves > 0:
        yield meet_leaves(direction, distance, NearLeaves(failure.near_leaves, seeds[1])), distance


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
