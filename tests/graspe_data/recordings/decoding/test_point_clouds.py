from __future__ import annotations

import math
import struct
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from graspe_data.errors import RecordingError
from graspe_data.recordings.decoding import cloud_decoder, decode_points
from graspe_data.sensor_data import PointCloud

CODES = {1: "b", 2: "B", 3: "h", 4: "H", 5: "i", 6: "I", 7: "f", 8: "d"}
XYZ = [("x", 0, 7), ("y", 4, 7), ("z", 8, 7)]


def slow_points(message: Any) -> list[tuple[float, float, float, float | None, int | None]]:
    """One point after the other with struct: x, y, z, intensity, ring."""
    order = ">" if message.is_bigendian else "<"
    fields = {field.name: field for field in message.fields}
    intensity = next(
        (n for n in ("intensity", "intensities", "i", "reflectivity") if n in fields), ""
    )
    ring = next((n for n in ("ring", "channel", "laser_id", "line") if n in fields), "")
    kept = []
    for row in range(message.height):
        for column in range(message.width):
            place = row * message.row_step + column * message.point_step

            def value(name: str, place: int = place) -> Any:
                code = order + CODES[fields[name].datatype]
                return struct.unpack_from(code, message.data, place + fields[name].offset)[0]

            with np.errstate(all="ignore"):
                xyz = [float(np.float32(value(axis))) for axis in "xyz"]
                strength = float(np.float32(value(intensity))) if intensity else None
            number = int(np.int64(value(ring)).astype(np.int32)) if ring else None
            if all(map(math.isfinite, xyz)) and any(xyz):
                kept.append((*xyz, strength, number))
    return kept  # type: ignore[return-value]


def as_points(cloud: PointCloud) -> list[tuple[float, float, float, float | None, int | None]]:
    count = len(cloud.xyz)
    strengths = [None] * count if cloud.intensity is None else cloud.intensity.tolist()
    rings = [None] * count if cloud.ring is None else cloud.ring.tolist()
    rows = zip(cloud.xyz.tolist(), strengths, rings, strict=True)
    return [(xyz[0], xyz[1], xyz[2], strength, ring) for xyz, strength, ring in rows]


@dataclass
class Layout:
    fields: list[tuple[str, int, int]]
    step: int
    height: int
    width: int
    row_step: int
    big_endian: bool
    data: bytes


COORDINATES = st.one_of(
    st.integers(-60_000, 60_000).map(lambda count: count / 64),
    st.floats(0.125, 500, width=32),
    st.sampled_from([0.0, math.nan, math.inf, -math.inf]),
)


@st.composite
def layouts(draw: st.DrawFn) -> Layout:
    """Any order, padding, types and shape."""
    names = ["x", "y", "z"]
    for choices in (
        ("intensity", "intensities", "i", "reflectivity"),
        ("ring", "channel", "laser_id", "line"),
    ):
        names += draw(st.lists(st.sampled_from(choices), max_size=1))
    names += draw(st.lists(st.sampled_from(["time", "rgb", "tag"]), unique=True))
    fields, offset = [], draw(st.integers(0, 3))
    for name in draw(st.permutations(names)):
        kinds = {"x": (7, 8), "y": (7, 8), "z": (7, 8)}.get(name, tuple(CODES))
        kinds = tuple(range(1, 7)) if name in ("ring", "channel", "laser_id", "line") else kinds
        datatype = draw(st.sampled_from(kinds))
        fields.append((name, offset, datatype))
        offset += struct.calcsize("<" + CODES[datatype]) + draw(st.integers(0, 3))
    height, width = draw(st.integers(0, 3)), draw(st.integers(0, 5))
    row_step = width * offset + draw(st.integers(0, 7))
    big_endian = draw(st.booleans())
    data = bytearray(draw(st.randoms(use_true_random=False)).randbytes(height * row_step))
    for row in range(height):
        for column in range(width):
            for name, start, datatype in fields:
                if datatype > 6:
                    place = row * row_step + column * offset + start
                    code = (">" if big_endian else "<") + CODES[datatype]
                    value = draw(COORDINATES) if name in ("x", "y", "z") else 0.5
                    struct.pack_into(code, data, place, value)
    return Layout(fields, offset, height, width, row_step, big_endian, bytes(data))


@settings(max_examples=150, deadline=None)
@given(layouts())
def test_any_layout_decodes_as_one_point_after_the_other(build_ros2: Any, layout: Layout) -> None:
    message = build_ros2.cloud(
        layout.fields,
        layout.data,
        layout.step,
        height=layout.height,
        width=layout.width,
        row_step=layout.row_step,
        is_bigendian=layout.big_endian,
    )
    cloud = decode_points(message, "/points")
    assert as_points(cloud) == slow_points(message)
    assert cloud.xyz.dtype == np.float32
    assert cloud.xyz.T.flags.c_contiguous  # axis by axis, as an observation reads it
    assert cloud.intensity is None or cloud.intensity.dtype == np.float32
    assert cloud.ring is None or cloud.ring.dtype == np.int32


def test_the_clouds_of_the_velodyne_driver(build: Any) -> None:
    fields = [*XYZ, ("intensity", 12, 7), ("ring", 16, 4), ("time", 18, 7)]
    points = [(1.0, 2.0, 3.0, 10.0, 5, 0.1), (math.nan, 0.0, 0.0, 1.0, 6, 0.2)]
    points += [(0.0, 0.0, 0.0, 7.0, 8, 0.3), (0.0, 0.0, -1.0, 255.0, 15, 0.4)]
    data = b"".join(struct.pack("<ffffHf", *point) for point in points)
    cloud = decode_points(build.cloud(fields, data, 22), "/points")
    assert as_points(cloud) == [(1.0, 2.0, 3.0, 10.0, 5), (0.0, 0.0, -1.0, 255.0, 15)]
    assert (cloud.stamp_ns, cloud.frame) == (12_000_000_034, "sensor")


@pytest.mark.parametrize("across", [False, True])
def test_an_organised_cloud_gives_the_side_that_is_a_ring(build: Any, across: bool) -> None:
    azimuth, slope = np.meshgrid(np.radians(np.arange(0, 360, 9)), [-0.2, 0.0, 0.3])
    xyz = np.stack([5 * np.cos(azimuth), 5 * np.sin(azimuth), 5 * slope], -1).astype("<f4")
    xyz[1, 2] = np.nan
    grid = np.ascontiguousarray(xyz.transpose(1, 0, 2) if across else xyz)
    height, width, _ = grid.shape
    shape = {"height": height, "width": width, "row_step": 12 * width}
    ring = decode_points(build.cloud(XYZ, grid.tobytes(), 12, **shape), "/points").ring
    truth = np.repeat([0, 1, 2], 40).reshape(3, 40)
    kept = np.isfinite(xyz[..., 0])
    assert ring is not None
    assert ring.tolist() == (truth.T[kept.T] if across else truth[kept]).tolist()


@pytest.mark.parametrize(("height", "width"), [(1, 8), (8, 1)])
def test_a_cloud_of_one_row_or_one_column_is_not_organised(
    build: Any, height: int, width: int
) -> None:
    data = np.ones((8, 3), "<f4").tobytes()
    message = build.cloud(XYZ, data, 12, height=height, width=width, row_step=12 * width)
    assert decode_points(message, "/points").ring is None


def test_a_ring_of_floats_is_no_ring(build: Any) -> None:
    data = np.ones((8, 4), "<f4").tobytes()
    cloud = decode_points(build.cloud([*XYZ, ("ring", 12, 7)], data, 16), "/points")
    assert cloud.ring is None


def test_a_coordinate_beyond_float32_is_no_return(build: Any) -> None:
    fields = [("x", 0, 8), ("y", 8, 8), ("z", 16, 8)]
    data = np.array([[1e300, 1, 1], [1, 2, 3]], "<f8").tobytes()
    assert decode_points(build.cloud(fields, data, 24), "/points").xyz.tolist() == [[1, 2, 3]]


@pytest.mark.parametrize("fields", [[], XYZ])
def test_an_empty_cloud_has_no_points(build: Any, fields: list[tuple[str, int, int]]) -> None:
    cloud = decode_points(build.cloud(fields, b"", 12), "/points")
    assert cloud.xyz.shape == (0, 3)


@pytest.mark.parametrize(
    ("fields", "changes", "fault"),
    [
        (XYZ[:2], {}, "found the fields x f4, y f4"),
        ([*XYZ[:2], ("z", 8, 5)], {}, "z i4"),
        ([*XYZ[:2], ("z", 8, 99)], {}, "z \\?"),
        ([*XYZ[:2], ("z", 9, 7)], {}, "field z takes bytes 9 to 13 of a point of 12"),
        ([*XYZ[:2], ("z", 4_000_000_000, 7)], {}, "field z takes bytes"),
        (XYZ, {"width": 9}, "need 108 bytes of data; found 96"),
        (XYZ, {"width": 4_000_000_000, "height": 4_000_000_000}, "need"),
        (XYZ, {"height": 2, "width": 4, "row_step": 47}, "47 a row"),
        (XYZ, {"point_step": 0}, "of a point of 0 bytes"),
        (XYZ, {"point_step": 4_000_000_000}, "need"),
    ],
)
def test_a_cloud_that_does_not_fit_is_refused(
    build_ros2: Any, fields: list[tuple[str, int, int]], changes: dict[str, Any], fault: str
) -> None:
    message = build_ros2.cloud(fields, np.ones((8, 3), "<f4").tobytes(), 12)
    for name, value in changes.items():
        setattr(message, name, value)
    with pytest.raises(RecordingError, match=fault) as refused:
        decode_points(message, "/points")
    assert "/points, header stamp 12.000000034" in str(refused.value)


@pytest.mark.parametrize(
    ("name", "topic", "has_intensity", "has_ring"),
    [
        ("rosnumpy_rgb8_cloud15.bag", "/pointcloud", False, False),
        ("rerun_rosbag2_image_cloud_scan.mcap", "/point_cloud2", True, False),
        ("embag_luminar_scan_odom_lz4.bag", "/luminar_pointcloud", True, True),
        ("akimap_loam_cloud_tf.bag", "/pointcloud_in", True, False),
    ],
)
def test_real_clouds(
    real_messages: Callable[[str, str], Any],
    name: str,
    topic: str,
    has_intensity: bool,
    has_ring: bool,
) -> None:
    message, kind = next(iter(real_messages(name, topic)))
    cloud = cloud_decoder(kind, topic, "generic")(message)
    assert len(cloud.xyz) > 0
    assert (cloud.intensity is not None, cloud.ring is not None) == (has_intensity, has_ring)
    message.width = min(message.width, 2000)
    assert as_points(decode_points(message, topic)) == slow_points(message)


def test_the_clouds_of_the_street(real_messages: Callable[[str, str], Any]) -> None:
    folder, topic = "kitti_street_camera_lidar_odometry", "/kitti/velo/pointcloud"
    clouds = [decode_points(message, topic) for message, _ in real_messages(folder, topic)]
    assert len(clouds) == 39
    for cloud in clouds:
        assert 70_000 <= len(cloud.xyz) <= 115_000
        assert cloud.ring is None
        assert cloud.intensity is not None
        assert cloud.intensity.min() >= 0
        assert cloud.intensity.max() <= 1


def test_other_types_hold_no_cloud() -> None:
    with pytest.raises(RecordingError, match="holds no cloud"):
        cloud_decoder("sensor_msgs/msg/LaserScan", "/scan", "generic")


def test_packets_that_are_known_and_not_read_are_named() -> None:
    with pytest.raises(RecordingError, match="packets of RoboSense are not read"):
        cloud_decoder("robosense_msgs/msg/RobosenseScan", "/rs", "generic")
