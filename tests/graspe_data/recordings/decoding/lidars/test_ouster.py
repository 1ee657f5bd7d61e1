from __future__ import annotations

import json
import struct
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from graspe_data.errors import RecordingError
from graspe_data.inspection.roles import roles_of
from graspe_data.recordings import Recording, RecordingWriter, open_recording
from graspe_data.recordings.decoding.lidars.cloud_source import CloudMessage, CloudSource
from graspe_data.recordings.decoding.lidars.ouster import OUSTER_TYPES, OusterDecoder
from graspe_data.recordings.decoding.lidars.ouster_metadata import parse_metadata
from graspe_data.recordings.decoding.lidars.scan_assembly import Scan, ScanAssembler
from graspe_data.recordings.message_types import message_classes
from graspe_data.robot import Lidar
from graspe_data.sensor_data import PointCloud

CHANNELS, COLUMNS, PACKED = 16, 512, 16
# By the firmware manual: bytes of the packet's header, of a column's header and footer, of a pixel.
SHAPES = {
    "LEGACY": (0, 16, 4, 12),
    "RNG19_RFL8_SIG16_NIR16": (32, 12, 0, 12),
    "RNG19_RFL8_SIG16_NIR16_DUAL": (32, 12, 0, 16),
    "RNG15_RFL8_NIR8": (32, 12, 0, 4),
}
BEGIN, STEP = 10**12, 10**5
TOPIC = "/ouster/lidar_packets"


def metadata(profile: str, **changes: Any) -> str:
    """Flat metadata, as firmware 2.0 sends it, of a lidar with 16 channels."""
    layout: dict[str, Any] = {"columns_per_frame": COLUMNS, "columns_per_packet": PACKED}
    layout |= {"pixels_per_column": CHANNELS, "column_window": [0, COLUMNS - 1]}
    content = {
        "data_format": layout | {"udp_profile_lidar": profile} | changes.pop("layout", {}),
        "beam_altitude_angles": np.linspace(20, -20, CHANNELS).tolist(),
        "beam_azimuth_angles": (np.arange(CHANNELS) % 4 * 3.0 - 4.5).tolist(),
        "lidar_origin_to_beam_origin_mm": 15.806,
        "lidar_to_sensor_transform": [-1, 0, 0, 0, 0, -1, 0, 0, 0, 0, 1, 36.18, 0, 0, 0, 1],
        "config_params": {"timestamp_mode": "TIME_FROM_PTP_1588"},
    }
    return json.dumps({k: v for k, v in (content | changes).items() if v is not None})


def packet(profile: str, pixels: Any, first: int, frame: int = 7, valid: bool = True) -> bytes:
    """A packet of 16 columns from ``first`` on; ``pixels`` (columns, channels, bytes)."""
    header, _, footer, _ = SHAPES[profile]
    columns = []
    for number, column in enumerate(pixels, first):
        stamp = BEGIN + number * STEP + frame * 10**8
        if header:
            head = struct.pack("<QHH", stamp, number, valid)
        else:
            head = struct.pack("<QHHI", stamp, number, frame, number * 88)
        columns.append(head + bytes(column) + (b"\xff" if valid else b"\0") * footer)
    start = struct.pack("<HH", 1, frame).ljust(header, b"\0") if header else b""
    return start + b"".join(columns) + bytes(header)


def frame_of(profile: str, frame: int = 7, seed: int = 20) -> list[bytes]:
    """The packets of a frame, all of whose bytes are random but for what says what they are."""
    header, before, footer, pixel = SHAPES[profile]
    random, packets = np.random.default_rng(seed), []
    column = before + CHANNELS * pixel + footer
    for first in range(0, COLUMNS, PACKED):
        size = 2 * header + PACKED * column
        body = random.integers(0, 256, size, np.uint8)[header : size - header]
        pixels = body.reshape(PACKED, column)[:, before : before + CHANNELS * pixel]
        packets.append(packet(profile, [row.tobytes() for row in pixels], first, frame))
    return packets


def assembler(profile: str, **changes: Any) -> ScanAssembler:
    return ScanAssembler(OusterDecoder(parse_metadata(metadata(profile, **changes), "/m"), TOPIC))


def fed(joined: ScanAssembler, packets: list[bytes]) -> list[Scan]:
    """The scans that packets give, a millisecond from one to the next."""
    found = [joined.take(np.frombuffer(p, np.uint8), k * 10**6) for k, p in enumerate(packets)]
    return [scan for scan in [*found, joined.rest()] if scan is not None]


# ouster-sdk 1.0.1 on these very packets (ScanBatcher, XYZLut without extrinsics): returns, sum of
# the reflectivity, and sums of |x|, |y| and |z| in metres, of the first and the second returns.
OUSTER_SDK = {
    "LEGACY": [(8192, 1058932, (2668427.547, 2670292.96, 789765.649))],
    "RNG19_RFL8_SIG16_NIR16": [(8192, 1042111, (1333079.994, 1339798.503, 393795.24))],
    "RNG19_RFL8_SIG16_NIR16_DUAL": [
        (8192, 1051124, (1330430.288, 1334962.267, 393479.385)),
        (8192, 1035542, (1339696.786, 1329563.724, 395058.145)),
    ],
    "RNG15_RFL8_NIR8": [(8192, 1046593, (663670.559, 658843.181, 195446.933))],
}


@pytest.mark.parametrize("profile", SHAPES)
def test_random_pixels_decode_as_by_the_sdk_of_the_maker(profile: str) -> None:
    (scan,) = fed(assembler(profile), frame_of(profile))
    cloud = scan.cloud()
    assert cloud.intensity is not None
    start = 0
    for returns, reflectivity, sums in OUSTER_SDK[profile]:
        part = slice(start, start + returns)
        assert int(cloud.intensity[part].sum(dtype=np.float64)) == reflectivity
        found = np.abs(cloud.xyz[part].astype(np.float64)).sum(axis=0)
        np.testing.assert_allclose(found, sums, rtol=1e-7)
        start += returns
    assert len(cloud.xyz) == start


def test_a_return_lies_where_the_manual_says() -> None:
    """Range 10 m in column 128 of 512 on row 3: a quarter turn clockwise of zero."""
    profile = "RNG19_RFL8_SIG16_NIR16"
    pixels = np.zeros((PACKED, CHANNELS, 12), np.uint8)
    pixels[0, 3, :5] = [*struct.pack("<I", 10_000), 90]
    joined = assembler(profile)
    joined.take(np.frombuffer(packet(profile, pixels.reshape(PACKED, -1), 128), np.uint8), 5)
    scan = joined.rest()
    assert scan is not None
    cloud = scan.cloud()
    encoder = np.radians(270.0)
    altitude, aside = np.radians(20 - 3 * 40 / 15), 0.015806
    flat = (10 - aside) * np.cos(altitude)
    x = flat * np.cos(encoder - np.radians(-4.5 + 9)) + aside * np.cos(encoder)
    y = flat * np.sin(encoder - np.radians(-4.5 + 9)) + aside * np.sin(encoder)
    z = (10 - aside) * np.sin(altitude) + 0.03618
    np.testing.assert_allclose(cloud.xyz, [[-x, -y, z]], atol=1e-5)
    assert cloud.ring is not None
    assert cloud.intensity is not None
    assert (cloud.ring.tolist(), cloud.intensity.tolist()) == ([3], [90.0])
    assert cloud.stamp_ns == scan.stamp_ns == BEGIN + 128 * STEP + 7 * 10**8
    assert (cloud.frame, scan.bag_time_ns, scan.share) == ("os_sensor", 5, 1 / 32)


def test_of_two_returns_both_are_kept_where_they_differ() -> None:
    profile = "RNG19_RFL8_SIG16_NIR16_DUAL"
    pixels = np.zeros((PACKED, CHANNELS, 16), np.uint8)
    for row, (first, second) in enumerate([(5000, 5000), (5000, 6000), (5000, 0), (0, 0)]):
        pixels[0, row, :8] = [*struct.pack("<I", first), *struct.pack("<I", second)]
    joined = assembler(profile)
    joined.take(np.frombuffer(packet(profile, pixels.reshape(PACKED, -1), 0), np.uint8), 0)
    scan = joined.rest()
    assert scan is not None
    assert np.asarray(scan.cloud().ring).tolist() == [0, 1, 2, 1]


PROFILE = "RNG15_RFL8_NIR8"


def test_frames_follow_each_other_and_the_last_may_be_cut_off() -> None:
    packets = [p for frame in (65_534, 65_535, 0, 1) for p in frame_of(PROFILE, frame)][20:-20]
    scans = fed(assembler(PROFILE), packets)
    assert [scan.share for scan in scans] == [12 / 32, 1.0, 1.0, 12 / 32]
    assert [scan.bag_time_ns for scan in scans] == [0, 12 * 10**6, 44 * 10**6, 76 * 10**6]


def test_a_whole_scan_is_given_with_its_last_packet() -> None:
    joined = assembler(PROFILE)
    given = [joined.take(np.frombuffer(p, np.uint8), 0) for p in frame_of(PROFILE)]
    assert [scan is not None for scan in given] == [False] * 31 + [True]
    assert joined.rest() is None


def test_a_lost_packet_costs_its_columns_alone() -> None:
    packets = frame_of(PROFILE, 7) + frame_of(PROFILE, 8)
    whole, _ = fed(assembler(PROFILE), packets)
    lossy, after = fed(assembler(PROFILE), packets[:31] + packets[32:])
    assert (whole.share, lossy.share, after.share) == (1.0, 31 / 32, 1.0)
    np.testing.assert_array_equal(lossy.cloud().xyz, whole.cloud().xyz[: 31 * 16 * 16])


def test_packets_out_of_order_twice_or_too_late() -> None:
    first, second = frame_of(PROFILE, 7), frame_of(PROFILE, 8)
    swapped = [first[1], first[0], *first[2:], second[0], second[0], *second[1:], first[31]]
    joined = assembler(PROFILE)
    straight, mixed = fed(assembler(PROFILE), first + second), fed(joined, swapped)
    assert [scan.share for scan in mixed] == [1.0, 1.0]
    assert joined.late == 1
    for one, other in zip(straight, mixed, strict=True):
        np.testing.assert_array_equal(one.cloud().xyz, other.cloud().xyz)


def test_columns_that_the_sensor_marks_as_invalid_do_not_count() -> None:
    pixels = np.full((PACKED, CHANNELS * 4), 9, np.uint8)
    packets = [packet(PROFILE, pixels, 0, valid=False), packet(PROFILE, pixels, 16)]
    (scan,) = fed(assembler(PROFILE), packets)
    assert len(scan.cloud().xyz) == PACKED * CHANNELS
    assert fed(assembler(PROFILE), packets[:1]) == []


def test_a_window_of_columns_is_a_whole_scan() -> None:
    pixels = np.full((PACKED, CHANNELS * 4), 9, np.uint8)
    packets = [packet(PROFILE, pixels, first, k) for k in (1, 2) for first in (480, 496, 0, 16)]
    scans = fed(assembler(PROFILE, layout={"column_window": [485, 20]}), packets)
    assert [scan.share for scan in scans] == [1.0, 1.0]


@pytest.mark.parametrize("wrong", [0, 11, 8447, 2128, 4096])
def test_a_packet_of_another_size_is_refused_and_the_frame_goes_on(wrong: int) -> None:
    packets, joined = frame_of(PROFILE), assembler(PROFILE)
    joined.take(np.frombuffer(packets[0], np.uint8), 0)
    if wrong == len(packets[0]):
        wrong += 1
    with pytest.raises(RecordingError, match=rf"{TOPIC}: a packet of {wrong} bytes"):
        joined.take(np.zeros(wrong, np.uint8), 1)
    assert len(fed(joined, packets[1:])) == 1


def test_a_column_that_no_frame_has_is_refused() -> None:
    pixels = np.zeros((PACKED, CHANNELS * 4), np.uint8)
    with pytest.raises(RecordingError, match="column 513; expected less than 512"):
        assembler(PROFILE).take(np.frombuffer(packet(PROFILE, pixels, 498), np.uint8), 0)


@settings(deadline=None, max_examples=100)
@given(st.sampled_from(list(SHAPES)), st.randoms(use_true_random=False), st.integers(0, 60))
def test_damaged_packets_give_finite_points_or_one_clear_error(
    profile: str, random: Any, changes: int
) -> None:
    joined, scans = assembler(profile), []
    for data in frame_of(profile)[:3]:
        damaged = bytearray(data)
        for _ in range(changes):
            damaged[random.randrange(min(len(damaged), 60))] = random.randrange(256)
        try:
            scans.append(joined.take(np.frombuffer(bytes(damaged), np.uint8), 0))
        except RecordingError:
            continue
    for scan in [*scans, joined.rest()]:
        assert scan is None or np.isfinite(scan.cloud().xyz).all()


@pytest.mark.parametrize(
    ("changes", "fault"),
    [
        ({"beam_altitude_angles": None}, "no 'beam_altitude_angles'"),
        ({"data_format": None}, "no 'lidar_data_format'"),
        ({"lidar_origin_to_beam_origin_mm": None}, "no 'lidar_origin_to_beam_origin_mm'"),
        ({"beam_azimuth_angles": [1.0]}, "16 altitudes, 1 azimuths"),
        ({"beam_altitude_angles": ["x"] * 16}, "could not convert"),
        ({"beam_altitude_angles": [float("nan")] * 16}, "not finite"),
        ({"layout": {"columns_per_packet": 0}}, "512 columns a frame and 0 a packet"),
        ({"layout": {"columns_per_frame": 10**12}}, "columns a frame"),
        ({"layout": {"column_window": [0, 512]}}, "window of the columns 0 to 512"),
        ({"lidar_to_sensor_transform": [1.0] * 16}, "no rotation"),
        ({"lidar_to_sensor_transform": [1.0] * 3}, "a transform of 3 numbers"),
    ],
)
def test_metadata_that_cannot_be_is_refused(changes: dict[str, Any], fault: str) -> None:
    with pytest.raises(RecordingError, match=fault) as refused:
        parse_metadata(metadata(PROFILE, **changes), "/ouster/metadata")
    assert "/ouster/metadata: no metadata of an Ouster lidar" in str(refused.value)


@pytest.mark.parametrize("text", ["", "[]", "3", "{", "[" * 100_000, '{"a": 1}', " " * (1 << 23)])
def test_text_that_is_no_metadata_is_refused(text: str) -> None:
    with pytest.raises(RecordingError, match="metadata"):
        parse_metadata(text, "/m")


def test_a_profile_that_is_not_read_is_named() -> None:
    with pytest.raises(RecordingError, match="'FUSA_RNG15_RFL8_NIR8_DUAL' are not read"):
        assembler("FUSA_RNG15_RFL8_NIR8_DUAL")


def test_grouped_metadata_reads_as_the_flat_one() -> None:
    flat = json.loads(metadata(PROFILE))
    grouped = {
        "lidar_data_format": flat["data_format"],
        "beam_intrinsics": {
            k: v for k, v in flat.items() if k.startswith(("beam", "lidar_origin"))
        },
        "lidar_intrinsics": {"lidar_to_sensor_transform": flat["lidar_to_sensor_transform"]},
        "config_params": flat["config_params"],
    }
    one, other = parse_metadata(json.dumps(flat), ""), parse_metadata(json.dumps(grouped), "")
    assert one.profile == other.profile
    np.testing.assert_array_equal(one.sensor_from_lidar, other.sensor_from_lidar)
    np.testing.assert_array_equal(one.beam_origin, other.beam_origin)


def record(path: Path, kind: str, packets: list[bytes], text: str | None, container: Any) -> None:
    classes: Any = message_classes()
    with RecordingWriter(path, container) as writer:
        if text is not None:
            writer.write("/ouster/metadata", classes["std_msgs/msg/String"](text), 1)
        for k, data in enumerate(packets):
            said = classes[kind](np.frombuffer(data, np.uint8))
            writer.write(TOPIC, said, 10 + k)
            writer.write("/words", classes["std_msgs/msg/String"]("between"), 10 + k)


def clouds(recording: Recording) -> Iterator[PointCloud]:
    source = CloudSource(recording, TOPIC, Lidar())
    for item in source.gather(recording.messages([TOPIC])):
        assert isinstance(item, CloudMessage)
        yield item.decode()


@pytest.mark.parametrize("kind", OUSTER_TYPES)
@pytest.mark.parametrize("container", ["bag", "mcap", "db3"])
def test_a_recording_of_packets_is_read_as_clouds(
    tmp_path: Path, kind: str, container: Any
) -> None:
    path = tmp_path / ("drive.bag" if container == "bag" else "drive")
    packets = frame_of(PROFILE, 3) + frame_of(PROFILE, 4)[:20] + frame_of(PROFILE, 5)[:9]
    record(path, kind, packets, metadata(PROFILE), container)
    with open_recording(path) as recording:
        source = CloudSource(recording, TOPIC, Lidar())
        items = list(source.gather(recording.messages([TOPIC, "/words"])))
        found = [item for item in items if isinstance(item, CloudMessage)]
        again = list(clouds(recording))
    assert [(c.stamp_ns, c.bag_time_ns) for c in found] == [
        (BEGIN + 3 * 10**8, 10),
        (BEGIN + 4 * 10**8, 42),
    ]
    assert len(items) - len(found) == len(packets)
    for one, other in zip(found, again, strict=True):
        np.testing.assert_array_equal(one.decode().xyz, other.xyz)
    assert roles_of(TOPIC, kind) == ("points",)
    assert roles_of("/ouster/imu_packets", kind) == ()


@pytest.mark.parametrize(
    ("text", "fault"),
    [(None, r"need the metadata of their sensor on /ouster/metadata"), ("{}", "no metadata of an")],
)
def test_packets_without_metadata_are_refused(tmp_path: Path, text: str | None, fault: str) -> None:
    record(tmp_path / "drive", OUSTER_TYPES[0], frame_of(PROFILE)[:1], text, "mcap")
    with open_recording(tmp_path / "drive") as recording:  # noqa: SIM117
        with pytest.raises(RecordingError, match=fault):
            CloudSource(recording, TOPIC, Lidar())


# ouster-sdk 1.0.1 on the recording: row, column, range in mm, reflectivity, x, y, z in metres.
REAL = [
    (0, 264, 344, 164, 0.2375, -0.0648, 0.2645),
    (16, 177, 336, 144, 0.1925, 0.2057, 0.2104),
    (16, 400, 368, 155, -0.1053, -0.2896, 0.2285),
    (32, 3, 368, 160, -0.3357, 0.0607, 0.1681),
    (32, 130, 456, 135, 0.0711, 0.4162, 0.2022),
    (48, 3, 384, 134, -0.371, 0.0653, 0.1066),
    (48, 400, 1944, 75, -0.6402, -1.7952, 0.415),
    (64, 3, 1864, 150, -1.8333, 0.3353, 0.0403),
    (64, 257, 3216, 64, 3.176, -0.5037, 0.0434),
    (80, 132, 384, 99, 0.0698, 0.3704, -0.0328),
    (80, 261, 944, 16, 0.907, -0.1885, -0.1413),
    (96, 5, 1496, 29, -1.3519, 0.2918, -0.5279),
    (96, 400, 352, 154, -0.1083, -0.3084, -0.0884),
    (112, 5, 1640, 1, -1.3266, 0.3027, -0.8703),
    (112, 432, 1304, 3, -0.739, -0.7914, -0.6814),
]
REAL_RETURNS_EVERY_EIGHTH_ROW = [81, 156, 218, 280, 400, 387, 381, 383]
REAL_RETURNS_EVERY_EIGHTH_ROW += [414, 396, 287, 333, 212, 119, 57, 42]


def test_the_truth_of_a_real_scan(recordings: Path) -> None:
    """One whole frame of an OS-0-128; its clock counts from when it was switched on."""
    topic = "/os_node0/lidar_packets"
    with open_recording(recordings / "ouster_512x10_packets.bag") as recording:
        source = CloudSource(recording, topic, Lidar())
        (item,) = source.gather(recording.messages([topic]))
    assert isinstance(item, CloudMessage)
    cloud = item.decode()
    assert (item.stamp_ns, item.share, cloud.stamp_ns) == (None, 1.0, 291_159_252_580)
    assert cloud.intensity is not None
    assert cloud.ring is not None
    assert (len(cloud.xyz), int(cloud.intensity.sum(dtype=np.float64))) == (28751, 2720313)
    sums = np.abs(cloud.xyz.astype(np.float64)).sum(axis=0)
    np.testing.assert_allclose(sums, [19190.07907834, 19222.84826179, 6224.06991277], rtol=1e-6)
    counts = np.bincount(cloud.ring, minlength=128)[::8]
    assert counts.tolist() == REAL_RETURNS_EVERY_EIGHTH_ROW
    for row, _, _, reflectivity, *place in REAL:
        near = np.abs(cloud.xyz - place).max(axis=1) < 1e-4
        assert cloud.ring[near].tolist() == [row]
        assert cloud.intensity[near].tolist() == [reflectivity]
