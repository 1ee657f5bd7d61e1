"""Clouds, pictures and cameras that the tests of the room share."""

from collections.abc import Callable

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from graspe_data.geometry import Transform
from graspe_data.robot import Intrinsics
from graspe_data.sensor_data import PointCloud

Floats = NDArray[np.float32]
Rings = NDArray[np.int32]
Room = Callable[..., tuple[Floats, Rings]]


@pytest.fixture(scope="session")
def room() -> Room:
    """A factory of clouds (xyz, ring) of a spinning lidar in a room with a floor and columns."""

    def scan(
        elevations: NDArray[np.float64], azimuths: int = 900, height: float = 0.7, origin: float = 0
    ) -> tuple[Floats, Rings]:
        rng = np.random.default_rng(3)
        azimuth = np.linspace(-np.pi, np.pi, azimuths, endpoint=False) + 1e-3
        turn, rise = np.meshgrid(azimuth, elevations)
        far = 12 / np.maximum(np.abs(np.cos(turn)), 1e-3)
        far = np.minimum(far, 7 / np.maximum(np.abs(np.sin(turn)), 1e-3))
        for centre, distance in ((-2.0, 4.0), (0.4, 3.0), (2.5, 6.0)):
            far = np.where(np.abs(turn - centre) < 0.08, distance, far)
        floor = np.where(rise < 0, (height + origin) / np.tan(np.maximum(-rise, 1e-6)), np.inf)
        reach = np.minimum(far, floor) / np.cos(rise) + rng.normal(0, 0.01, turn.shape)
        flat = reach * np.cos(rise)
        up = reach * np.sin(rise) + origin
        xyz = np.stack((flat * np.cos(turn), flat * np.sin(turn), up), axis=-1)
        seen = up < 3
        ring = np.broadcast_to(np.arange(len(elevations))[:, None], turn.shape)
        return xyz[seen].astype(np.float32), ring[seen].astype(np.int32)

    return scan


@pytest.fixture(scope="session")
def cloud(room: Room) -> PointCloud:
    """A VLP-16's cloud with rings and intensities."""
    xyz, ring = room(np.radians(np.arange(-15, 16, 2.0)))
    intensity = np.random.default_rng(1).integers(0, 256, len(xyz)).astype(np.float32)
    return PointCloud(0, "velodyne", xyz, intensity, ring)


@pytest.fixture(scope="session")
def textured() -> NDArray[np.uint8]:
    """A picture full of corners, uint8 (240, 320, 3)."""
    noise = np.random.default_rng(2).integers(40, 256, (60, 80, 3), dtype=np.uint8)
    return np.asarray(cv2.resize(noise, (320, 240), interpolation=cv2.INTER_CUBIC), np.uint8)


@pytest.fixture
def camera() -> Intrinsics:
    """A camera whose principal point is the picture's centre."""
    return Intrinsics(width=320, height=240, fx=250.0, fy=250.0, cx=159.5, cy=119.5)


@pytest.fixture
def mounted() -> Transform:
    """Half a metre above base_link, 0.3 m ahead, looking along its x axis."""
    optical = np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
    return Transform(optical, np.array([0.3, 0.0, 0.5]))
