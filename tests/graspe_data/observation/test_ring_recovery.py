"""Rings are recovered where the cloud does not name them."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from graspe_data.observation.point_reliability import PointReliabilitySettings, point_reliability
from graspe_data.observation.ring_order import ring_order
from graspe_data.observation.ring_recovery import recover_rings
from graspe_data.observation.smoothness import smoothness
from graspe_data.recordings import open_recording
from graspe_data.recordings.decoding import decode_points

Room = Callable[..., tuple[NDArray[np.float32], NDArray[np.int32]]]

VLP_16 = np.arange(-15, 16, 2.0)
NEAR_LEVEL = np.arange(-4, 2) + np.array([[0], [1], [2]]) / 3
VLP_32C = np.sort(
    np.concatenate(
        (
            [-25, -15.639, -11.31, -8.843, -7.254, -6.148, -5.333, -4.667],
            NEAR_LEVEL.round(3).ravel(),
            [2.333, 3.333, 4.667, 7, 10.333, 15],
        )
    )
)
EVEN_64 = np.linspace(-22.5, 22.5, 64)


@pytest.mark.parametrize("known", [True, False], ids=["count known", "count unknown"])
@pytest.mark.parametrize("elevations", [VLP_16, VLP_32C, EVEN_64], ids=["16", "32C", "even 64"])
@pytest.mark.parametrize("origin", [0.0, 0.036, 0.2])
def test_every_point_goes_to_its_ring(
    room: Room, elevations: NDArray[np.float64], known: bool, origin: float
) -> None:
    xyz, ring = room(np.radians(elevations), origin=origin)
    found = recover_rings(xyz, len(elevations) if known else None)
    assert np.array_equal(found, np.unique(ring, return_inverse=True)[1])


def test_two_blocks_of_lasers_at_different_heights(room: Room) -> None:
    upper, ring = room(np.radians(np.linspace(-8, 2, 32)), origin=0.2, height=1.73)
    lower, ring_below = room(np.radians(np.linspace(-24, -9, 32)), origin=0.12, height=1.73)
    found = recover_rings(np.concatenate((lower, upper)))
    assert np.mean(found == np.concatenate((ring_below, ring + 32))) > 0.999


@pytest.mark.parametrize("total", [0, 1, 5, 3000])
def test_a_cloud_without_rings_gets_numbers_that_do_not_depend_on_its_order(total: int) -> None:
    rng = np.random.default_rng(total)
    xyz = rng.normal(0, 4, (total, 3)).astype(np.float32)
    shuffle = rng.permutation(total)
    assert np.array_equal(recover_rings(xyz)[shuffle], recover_rings(xyz[shuffle]))


def _planar(xyz: NDArray[np.float32], ring: NDArray[np.integer] | None) -> float:
    found = ring_order(xyz, ring)
    c = smoothness(xyz[found.order], found.ring_starts)
    return point_reliability(c, PointReliabilitySettings()).r_planar


def test_the_rings_of_a_real_hdl_64(recordings: Path) -> None:
    topic = "/kitti/velo/pointcloud"
    with open_recording(recordings / "kitti_street_camera_lidar_odometry") as recording:
        clouds = [
            decode_points(recording.decode(raw), topic).xyz
            for raw in list(recording.messages([topic]))[::13]
        ]
    for xyz in clouds:
        azimuth = np.arctan2(xyz[:, 1], xyz[:, 0]) % (2 * np.pi)
        # The message is ring-major, the uppermost first, each ring from azimuth 0 round to 2 pi.
        named = 63 - np.cumsum(np.concatenate(([0], np.diff(azimuth) < -np.pi)))
        assert np.mean(recover_rings(xyz) == named) > 0.999
        assert 0.74 < _planar(xyz, None) < 0.82
        assert _planar(xyz, None) == pytest.approx(_planar(xyz, named), abs=0.001)


def test_the_rings_of_a_real_vlp_32(recordings: Path) -> None:
    xyz = _pcd_points(next((recordings / "nebula_vlp32").glob("*.pcd")))
    found = recover_rings(xyz)
    elevation = np.degrees(np.arctan2(xyz[:, 2], np.hypot(xyz[:, 0], xyz[:, 1])))
    means = [elevation[found == number].mean() for number in range(found.max() + 1)]
    assert means == pytest.approx(VLP_32C.tolist(), abs=0.001)


def _pcd_points(path: Path) -> NDArray[np.float32]:
    """The points of a binary PCD file that has no other fields."""
    header, body = path.read_bytes().split(b"DATA binary\n", 1)
    assert b"FIELDS x y z\nSIZE 4 4 4\n" in header
    return np.frombuffer(body, np.float32).reshape(-1, 3)
