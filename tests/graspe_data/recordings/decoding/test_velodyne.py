from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from graspe_data.errors import RecordingError
from graspe_data.recordings.decoding import VelodyneDecoder, cloud_decoder
from graspe_data.recordings.sensor_data import PointCloud

Floats = NDArray[np.float64]

PRODUCTS = {"VLP-16": 0x22, "VLP-32C": 0x28}
VLP16_ELEVATIONS = np.array([-15, 1, -13, 3, -11, 5, -9, 7, -7, 9, -5, 11, -3, 13, -1, 15])


def packet(distances: NDArray[np.integer], azimuths: list[int], product: int = 0x22) -> bytes:
    """Twelve blocks of 32 returns of intensity 100, strongest return only."""
    blocks = []
    for block, azimuth in enumerate(azimuths):
        returns = b"".join(int(d).to_bytes(2, "little") + b"\x64" for d in distances[block])
        blocks.append(b"\xff\xee" + azimuth.to_bytes(2, "little") + returns)
    return b"".join(blocks) + bytes(4) + bytes([0x37, product])


def scan(build: Any, *packets: bytes) -> Any:
    content = [SimpleNamespace(data=np.frombuffer(data, np.uint8)) for data in packets]
    return SimpleNamespace(header=build.header("velodyne"), packets=content)


TURNING = [block * 40 for block in range(12)]


def test_a_return_of_a_vlp16_lies_where_the_manual_says(build: Any) -> None:
    distances = np.zeros((12, 32), int)
    distances[3, :] = 5000
    message = scan(build, packet(distances, TURNING))
    cloud = VelodyneDecoder("VLP-16").decode(message, "/packets")
    # Manual 63-9243, section 9.5: 2 mm a count, 2.304 us a laser, 55.296 us a firing sequence.
    sequence, laser = np.divmod(np.arange(32), 16)
    turned = 0.4 * (55.296 * sequence + 2.304 * laser) / (2 * 55.296)
    azimuth, elevation = np.radians(1.2 + turned), np.radians(VLP16_ELEVATIONS[laser])
    flat = 10.0 * np.cos(elevation)
    rise = 10.0 * np.sin(elevation) - 0.04191 * np.tan(elevation)
    truth = np.stack([flat * np.cos(azimuth), -flat * np.sin(azimuth), rise], axis=1)
    order = np.lexsort((truth[:, 1], truth[:, 2].round(3)))
    found = cloud.xyz[np.lexsort((cloud.xyz[:, 1], cloud.xyz[:, 2].round(3)))]
    np.testing.assert_allclose(found, truth[order], atol=2e-3)
    assert cloud.ring is not None
    assert cloud.intensity is not None
    assert sorted(cloud.ring.tolist()) == sorted([*range(16), *range(16)])
    assert set(cloud.intensity.tolist()) == {100.0}
    assert (cloud.returns, cloud.stamp_ns, cloud.frame) == (384, 12_000_000_034, "velodyne")


@pytest.mark.parametrize("model", ["VLP-16", "VLP-32C"])
def test_rings_count_from_the_lowest_beam_up(build_ros2: Any, model: str) -> None:
    message = scan(build_ros2, packet(np.full((12, 32), 5000), TURNING, PRODUCTS[model]))
    cloud = VelodyneDecoder(model).decode(message, "/packets")
    assert cloud.ring is not None
    heights = [cloud.xyz[cloud.ring == ring, 2].mean() for ring in np.unique(cloud.ring)]
    assert len(heights) == (16 if model == "VLP-16" else 32)
    assert (np.diff(heights) > 0).all()


def test_a_generic_lidar_is_the_one_that_its_packets_name(build_ros2: Any) -> None:
    for model, product in PRODUCTS.items():
        message = scan(build_ros2, packet(np.full((12, 32), 5000), TURNING, product))
        named = VelodyneDecoder(model).decode(message, "/packets")
        found = VelodyneDecoder().decode(message, "/packets")
        np.testing.assert_array_equal(found.xyz, named.xyz)


def test_a_scan_without_packets_has_no_points(build_ros2: Any) -> None:
    cloud = VelodyneDecoder("VLP-16").decode(scan(build_ros2), "/packets")
    assert (cloud.xyz.shape, cloud.returns) == ((0, 3), 0)


def test_a_scan_without_returns_has_no_points(build_ros2: Any) -> None:
    message = scan(build_ros2, packet(np.zeros((12, 32), int), TURNING))
    cloud = VelodyneDecoder("VLP-16").decode(message, "/packets")
    assert (cloud.xyz.shape, cloud.returns) == ((0, 3), 384)


GOOD = packet(np.full((12, 32), 5000), TURNING)


@pytest.mark.parametrize(
    ("model", "packets", "fault"),
    [
        ("VLP-32C", [GOOD], "packets of VLP-16; expected VLP-32C"),
        ("VLP-16", [GOOD[:-1] + b"\x28"], "packets of VLP-32C; expected VLP-16"),
        ("generic", [GOOD[:-1] + b"\x21"], "product 0x21; expected VLP-16 or VLP-32C"),
        ("generic", [GOOD, GOOD[:-1] + b"\x28"], "packets of VLP-16, VLP-32C"),
        ("VLP-16", [GOOD[:-1]], "a packet of 1205 bytes"),
        ("VLP-16", [GOOD, b"\0" + GOOD[1:]], "packet 1 of 2 is damaged: .* flag 0xee00"),
        ("VLP-16", [GOOD[:2] + b"\xff\xff" + GOOD[4:]], "azimuth 65535"),
    ],
)
def test_packets_that_do_not_fit_are_refused(
    build_ros2: Any, model: str, packets: list[bytes], fault: str
) -> None:
    with pytest.raises(RecordingError, match=fault) as refused:
        VelodyneDecoder(model).decode(scan(build_ros2, *packets), "/packets")
    assert "/packets, header stamp 12.000000034" in str(refused.value)


def test_other_models_are_refused() -> None:
    with pytest.raises(RecordingError, match="'HDL-64E' are not read"):
        VelodyneDecoder("HDL-64E")


@settings(deadline=None)
@given(st.lists(st.tuples(st.integers(0, 2 * 1206 - 1), st.integers(0, 255)), max_size=40))
def test_damaged_packets_give_finite_points_or_one_clear_error(
    build_ros2: Any, changes: list[tuple[int, int]]
) -> None:
    data = bytearray(GOOD * 2)
    for position, value in changes:
        data[position] = value
    message = scan(build_ros2, bytes(data[:1206]), bytes(data[1206:]))
    try:
        cloud = VelodyneDecoder("VLP-16").decode(message, "/packets")
    except RecordingError:
        return
    assert np.isfinite(cloud.xyz).all()


def read_pcd(path: Path) -> NDArray[np.void]:
    """The points of a binary PCD, by the fields of its header."""
    content = path.read_bytes()
    start = content.index(b"DATA binary\n") + len(b"DATA binary\n")
    lines = (line.split() for line in content[:start].decode().splitlines())
    header = {words[0]: words[1:] for words in lines}
    kinds = [kind.lower() + size for kind, size in zip(header["TYPE"], header["SIZE"], strict=True)]
    dtype = np.dtype(list(zip(header["FIELDS"], kinds, strict=True)))
    return np.frombuffer(content, dtype, int(header["POINTS"][0]), start)


def without_beam_offset(xyz: NDArray[np.float32], offset: float) -> Floats:
    """Undo the vertical correction of the manual, -offset tan(elevation), which the truth lacks."""
    flat = np.hypot(xyz[:, 0], xyz[:, 1]).astype(np.float64)
    raised = xyz.astype(np.float64)
    raised[:, 2] *= flat / (flat - offset)
    return raised


def nearest(truth: Floats, found: Floats) -> Floats:
    """Distance of each true point to the nearest that was found, as an angle in degrees."""
    gaps = [
        np.linalg.norm(found[None] - some[:, None], axis=2).min(axis=1)
        for some in np.array_split(truth, len(truth) // 200)
    ]
    angles: Floats = np.degrees(np.concatenate(gaps) / np.linalg.norm(truth, axis=1))
    return angles


@pytest.fixture
def decoded(recordings: Path, read: Callable[[str, str], Any]) -> Callable[..., Any]:
    """The truth of a recording, and its scans as clouds."""

    def load(name: str, topic: str, model: str) -> tuple[NDArray[np.void], list[PointCloud]]:
        truth = read_pcd(next((recordings / name).glob("*.pcd")))
        messages = read(name, topic)
        return truth, [cloud_decoder(kind, topic, model)(message) for message, kind in messages]

    return load


def test_the_truth_of_the_vlp16(decoded: Callable[..., Any]) -> None:
    """Dual return; the truth cuts its scan at azimuth 0, inside the third message.

    The truth drops the later of two equal returns and keeps another azimuth where only one of the
    pair is kept: at most one block apart, 0.4 degrees.
    """
    truth, clouds = decoded("nebula_vlp16", "/velodyne_packets", "VLP-16")
    assert [len(cloud.xyz) for cloud in clouds] == pytest.approx([len(truth)] * 4, rel=0.005)
    found = without_beam_offset(np.concatenate([cloud.xyz for cloud in clouds[2:]]), 0.04191)
    sample = truth[::10]
    angles = nearest(np.stack([sample[axis] for axis in "xyz"], axis=1).astype(float), found)
    assert np.median(angles) < 1e-4
    assert np.quantile(angles, 0.95) < 1e-3
    assert angles.max() < 0.41


def test_the_truth_of_the_vlp32c(decoded: Callable[..., Any]) -> None:
    """The truth advances the azimuth twice as fast between firings: up to 0.13 degrees apart."""
    topic = "/sensing/lidar/front/velodyne_packets"
    truth, clouds = decoded("nebula_vlp32", topic, "VLP-32C")
    assert len(clouds[0].xyz) == pytest.approx(len(truth), rel=0.005)
    found = without_beam_offset(clouds[0].xyz, 0.03878)
    sample = truth[::10]
    angles = nearest(np.stack([sample[axis] for axis in "xyz"], axis=1).astype(float), found)
    assert np.quantile(angles, 0.98) < 0.15
