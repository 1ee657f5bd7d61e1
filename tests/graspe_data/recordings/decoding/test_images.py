from __future__ import annotations

from collections.abc import Callable
from typing import Any

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from graspe_data.errors import RecordingError
from graspe_data.recordings.decoding import decode_image

IMAGE = "sensor_msgs/msg/Image"
COMPRESSED = "sensor_msgs/msg/CompressedImage"

RED, GREEN, BLUE = 200, 100, 50
TRUTH = np.random.default_rng(0).integers(0, 256, (5, 6, 3), np.uint8)
GRAY = TRUTH[..., 0]


def padded(rows: NDArray[Any], padding: int) -> tuple[bytes, int]:
    """The bytes of a picture whose rows end in padding, and its step."""
    flat = np.ascontiguousarray(rows).view(np.uint8).reshape(len(rows), -1)
    full = np.pad(flat, ((0, 0), (0, padding)), constant_values=99)
    return full.tobytes(), full.shape[1]


def with_alpha(picture: NDArray[np.uint8]) -> NDArray[np.uint8]:
    return np.dstack([picture, np.full(picture.shape[:2], 7, np.uint8)])


@pytest.mark.parametrize("padding", [0, 1, 5])
@pytest.mark.parametrize(
    ("encoding", "rows", "expected"),
    [
        ("rgb8", TRUTH, TRUTH),
        ("bgr8", TRUTH[..., ::-1], TRUTH),
        ("8UC3", TRUTH[..., ::-1], TRUTH),
        ("rgba8", with_alpha(TRUTH), TRUTH),
        ("bgra8", with_alpha(TRUTH[..., ::-1]), TRUTH),
        ("8UC4", with_alpha(TRUTH[..., ::-1]), TRUTH),
        ("mono8", GRAY, np.dstack([GRAY] * 3)),
        ("8UC1", GRAY, np.dstack([GRAY] * 3)),
        ("mono16", GRAY.astype("<u2") * 257, np.dstack([GRAY] * 3)),
        ("rgb16", TRUTH.astype("<u2") * 257, TRUTH),
        ("bgr16", TRUTH[..., ::-1].astype("<u2") * 257, TRUTH),
    ],
)
def test_an_encoding_gives_the_picture_whatever_the_step(
    build: Any, encoding: str, rows: NDArray[Any], expected: NDArray[np.uint8], padding: int
) -> None:
    data, step = padded(rows, padding)
    picture = decode_image(build.image(encoding, 6, 5, data, step), IMAGE, "/camera")
    assert np.array_equal(picture.rgb, expected)
    assert picture.rgb.flags.c_contiguous
    assert (picture.stamp_ns, picture.frame) == (12_000_000_034, "sensor")


def test_a_last_row_without_its_padding_is_enough(build: Any) -> None:
    data, step = padded(TRUTH, 10)
    picture = decode_image(build.image("rgb8", 6, 5, data[:-10], step), IMAGE, "/camera")
    assert np.array_equal(picture.rgb, TRUTH)


@given(st.lists(st.integers(0, 65535), min_size=1, max_size=40), st.booleans())
def test_mono16_rounds_to_the_nearest_of_256_steps_in_both_byte_orders(
    build_ros2: Any, values: list[int], big_endian: bool
) -> None:
    data = np.array(values, ">u2" if big_endian else "<u2").tobytes()
    message = build_ros2.image(
        "mono16", len(values), 1, data, len(data), is_bigendian=int(big_endian)
    )
    rgb = decode_image(message, IMAGE, "/camera").rgb
    assert rgb[0, :, 1].tolist() == [round(value / 257) for value in values]


@pytest.mark.parametrize("depth", [8, 16])
@pytest.mark.parametrize("pattern", ["rggb", "bggr", "gbrg", "grbg"])
def test_a_bayer_mosaic_of_one_colour_gives_that_colour(
    build: Any, pattern: str, depth: int
) -> None:
    value = {"r": RED, "g": GREEN, "b": BLUE}
    tile = np.array([[value[c] for c in pattern[:2]], [value[c] for c in pattern[2:]]])
    mosaic = np.tile(tile, (4, 5)).astype(f"<u{depth // 8}") * (257 if depth == 16 else 1)
    data, step = padded(mosaic, 3)
    message = build.image(f"bayer_{pattern}{depth}", 10, 8, data, step)
    assert (decode_image(message, IMAGE, "/camera").rgb == (RED, GREEN, BLUE)).all()


LEFT, RIGHT = (200, 40, 20), (20, 60, 180)
SCENE = np.full((64, 96, 3), LEFT, np.uint8)
SCENE[:, 48:] = RIGHT


def mosaic_of(scene: NDArray[np.uint8], pattern: str) -> NDArray[np.uint8]:
    channels = np.array(["rgb".index(letter) for letter in pattern]).reshape(2, 2)
    rows, columns = np.mgrid[: scene.shape[0], : scene.shape[1]]
    return np.take_along_axis(scene, channels[rows % 2, columns % 2][..., None], axis=2)[..., 0]


def sides(rgb: NDArray[np.uint8]) -> NDArray[np.int64]:
    """The mean colours left and right of the edge, (2, 3)."""
    means = [rgb[8:-8, 8:40].mean((0, 1)), rgb[8:-8, 56:-8].mean((0, 1))]
    return np.rint(means).astype(np.int64)


@pytest.mark.parametrize("stored", ["", " bayer_{pattern}{bits}"])
@pytest.mark.parametrize(("suffix", "bits"), [(".jpg", 8), (".jpg", 16), (".png", 8), (".png", 16)])
@pytest.mark.parametrize("pattern", ["rggb", "bggr", "gbrg", "grbg"])
def test_a_mosaic_in_a_file_is_demosaiced(
    build: Any, pattern: str, suffix: str, bits: int, stored: str
) -> None:
    mosaic: NDArray[Any] = mosaic_of(SCENE, pattern)
    if (suffix, bits) == (".png", 16):
        mosaic = mosaic.astype(np.uint16) * 257
    codec = {".jpg": "jpeg", ".png": "png"}[suffix]
    said = f"bayer_{pattern}{bits}; {codec} compressed" + stored.format(pattern=pattern, bits=bits)
    data = cv2.imencode(suffix, mosaic, [cv2.IMWRITE_JPEG_QUALITY, 95])[1].tobytes()
    for form in (said, said + " "):
        rgb = decode_image(build.compressed(data, form), COMPRESSED, "/camera").rgb
        assert rgb.shape == SCENE.shape
        assert np.abs(sides(rgb) - (LEFT, RIGHT)).max() <= (0 if suffix == ".png" else 3)


@pytest.mark.parametrize("suffix", [".jpg", ".png"])
@pytest.mark.parametrize(
    "form",
    [
        "bayer_rggb8; jpeg compressed bgr8",
        "bayer_rggb8; jpeg compressed ",
        "bayer_gbrg16; png compressed bgr16",
        "rgb8; jpeg compressed bgr8",
        "rgb8; png compressed bgr8",
        "bgr8; jpeg compressed bgr8",
        "rgba8; png compressed bgr8",
        "yuv422; jpeg compressed bgr8",
        "jpeg",
    ],
)
def test_a_file_in_colour_is_shown_as_it_is(build_ros2: Any, suffix: str, form: str) -> None:
    data = cv2.imencode(suffix, SCENE[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, 95])[1].tobytes()
    rgb = decode_image(build_ros2.compressed(data, form), COMPRESSED, "/camera").rgb
    assert np.abs(sides(rgb) - (LEFT, RIGHT)).max() <= 3


@pytest.mark.parametrize(
    "form",
    [
        "mono8; jpeg compressed ",
        "mono8; jpeg compressed mono8",
        "mono16; jpeg compressed mono8",
        "bayer_rggb8; jpeg compressed mono8",
        "8UC1; png compressed ",
        "rgb8; jpeg compressed bgr8",
        "jpeg",
        "",
    ],
)
def test_a_grey_file_that_is_no_mosaic_stays_grey(build_ros2: Any, form: str) -> None:
    data = cv2.imencode(".png", GRAY)[1].tobytes()
    rgb = decode_image(build_ros2.compressed(data, form), COMPRESSED, "/camera").rgb
    assert np.array_equal(rgb, np.dstack([GRAY] * 3))


def test_a_grey_file_that_is_said_to_hold_colour_of_a_mosaic_is_refused(build_ros2: Any) -> None:
    data = cv2.imencode(".png", GRAY)[1].tobytes()
    message = build_ros2.compressed(data, "bayer_rggb8; jpeg compressed bgr8")
    with pytest.raises(RecordingError, match="the file has one channel"):
        decode_image(message, COMPRESSED, "/camera")


@pytest.mark.parametrize(
    "form",
    [
        "16UC1; png compressed ",
        "16UC1; png compressed mono16",
        "16UC1; jpeg compressed ",
        "32FC1; png compressed ",
        "16UC1; compressedDepth png",
        "32FC1; compressedDepth",
        "mono16; compressedDepth png",
        "16UC1",
        "png",
        "",
    ],
)
def test_depth_of_sixteen_bits_is_no_picture(build_ros2: Any, form: str) -> None:
    data = cv2.imencode(".png", np.full((6, 8), 2500, np.uint16))[1].tobytes()
    with pytest.raises(RecordingError, match="Name the colour topic of this camera"):
        decode_image(build_ros2.compressed(data, form), COMPRESSED, "/depth")


@pytest.mark.parametrize("form", ["mono16; png compressed ", "mono16; png compressed mono16"])
def test_a_grey_picture_of_sixteen_bits_is_told_by_its_encoding(build_ros2: Any, form: str) -> None:
    grey = GRAY.astype(np.uint16) * 257
    data = cv2.imencode(".png", grey)[1].tobytes()
    rgb = decode_image(build_ros2.compressed(data, form), COMPRESSED, "/camera").rgb
    assert np.array_equal(rgb, np.dstack([GRAY] * 3))


def test_colour_of_sixteen_bits_needs_no_format(build_ros2: Any) -> None:
    data = cv2.imencode(".png", TRUTH[..., ::-1].astype(np.uint16) * 257)[1].tobytes()
    for form in ("rgb16; png compressed bgr16", "png", ""):
        rgb = decode_image(build_ros2.compressed(data, form), COMPRESSED, "/camera").rgb
        assert np.array_equal(rgb, TRUTH)


@pytest.mark.parametrize(
    ("encoding", "order"),
    [("yuv422", "uyvy"), ("uyvy", "uyvy"), ("yuv422_yuy2", "yuyv"), ("yuyv", "yuyv")],
)
def test_yuv_is_bt601_of_limited_range(build: Any, encoding: str, order: str) -> None:
    y = 16 + (65.738 * RED + 129.057 * GREEN + 25.064 * BLUE) / 256
    u = 128 + (-37.945 * RED - 74.494 * GREEN + 112.439 * BLUE) / 256
    v = 128 + (112.439 * RED - 94.154 * GREEN - 18.285 * BLUE) / 256
    pair = bytes(round({"y": y, "u": u, "v": v}[c]) for c in order)
    message = build.image(encoding, 6, 2, pair * 6, 12)
    rgb = decode_image(message, IMAGE, "/camera").rgb.astype(int)
    assert np.abs(rgb - (RED, GREEN, BLUE)).max() <= 2


@pytest.mark.parametrize("form", ["jpeg", "jpg", "png", "bgr8; jpeg compressed bgr8", ""])
@pytest.mark.parametrize("suffix", [".png", ".jpg"])
def test_a_compressed_picture_is_told_by_its_bytes_not_its_format(
    build: Any, suffix: str, form: str
) -> None:
    flat = np.full((48, 64, 3), (RED, GREEN, BLUE), np.uint8)
    encoded = cv2.imencode(suffix, flat[..., ::-1])[1].tobytes()
    rgb = decode_image(build.compressed(encoded, form), COMPRESSED, "/camera").rgb
    assert rgb.shape == flat.shape
    assert np.abs(rgb.astype(int) - flat).max() <= (0 if suffix == ".png" else 2)


@pytest.mark.parametrize("channels", [1, 4])
def test_gray_and_transparent_files_become_rgb(build_ros2: Any, channels: int) -> None:
    source = GRAY if channels == 1 else with_alpha(TRUTH[..., ::-1])
    encoded = cv2.imencode(".png", source)[1].tobytes()
    rgb = decode_image(build_ros2.compressed(encoded), COMPRESSED, "/camera").rgb
    assert np.array_equal(rgb, np.dstack([GRAY] * 3) if channels == 1 else TRUTH)


def test_an_exif_orientation_is_not_applied(build_ros2: Any) -> None:
    encoded = cv2.imencode(".jpg", np.zeros((16, 32, 3), np.uint8))[1].tobytes()
    tiff = b"MM\0*\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01\0\x06\0\0\0\0\0\0"
    segment = b"Exif\0\0" + tiff
    turned = encoded[:2] + b"\xff\xe1" + (len(segment) + 2).to_bytes(2, "big") + segment
    rgb = decode_image(build_ros2.compressed(turned + encoded[2:]), COMPRESSED, "/camera").rgb
    assert rgb.shape == (16, 32, 3)


def test_a_jpeg_is_decoded_at_its_full_size(build_ros2: Any) -> None:
    flat = np.full((480, 640, 3), (BLUE, GREEN, RED), np.uint8)
    message = build_ros2.compressed(cv2.imencode(".jpg", flat)[1].tobytes())
    rgb = decode_image(message, COMPRESSED, "/camera").rgb
    assert rgb.shape == (480, 640, 3)
    assert np.abs(rgb.astype(int) - (RED, GREEN, BLUE)).max() <= 2


@pytest.mark.parametrize(
    ("changes", "fault"),
    [
        ({"encoding": "32UC1"}, "encoding '32UC1' is not supported"),
        ({"encoding": "32FC1"}, "encoding '32FC1' holds a measure"),
        ({"encoding": "16UC1"}, "Name the colour topic"),
        ({"step": 17}, "needs a step of at least 18 bytes"),
        ({"height": 6}, "found 90"),
        ({"width": 0}, "0x5 pixels"),
        ({"width": 20_000}, "20000x5 pixels"),
        ({"width": 16_000, "height": 16_000}, "16000x16000 pixels"),
        ({"encoding": "yuv422", "width": 5}, "cannot be converted"),
    ],
)
def test_a_raw_image_that_does_not_fit_is_refused(
    build_ros2: Any, changes: dict[str, Any], fault: str
) -> None:
    message = build_ros2.image("rgb8", 6, 5, TRUTH.tobytes(), 18)
    for name, value in changes.items():
        setattr(message, name, value)
    with pytest.raises(RecordingError, match=fault) as refused:
        decode_image(message, IMAGE, "/camera")
    assert "/camera, header stamp 12.000000034" in str(refused.value)


def resized(encoded: bytes, width: int, height: int) -> bytes:
    """A file whose header announces another size."""
    if encoded.startswith(b"\x89PNG"):
        return encoded[:16] + width.to_bytes(4, "big") + height.to_bytes(4, "big") + encoded[24:]
    frame = encoded.index(b"\xff\xc0") + 5
    size = height.to_bytes(2, "big") + width.to_bytes(2, "big")
    return encoded[:frame] + size + encoded[frame + 4 :]


@pytest.mark.parametrize("suffix", [".png", ".jpg"])
@pytest.mark.parametrize(("width", "height"), [(40_000, 10), (16_384, 16_384), (0, 10)])
def test_the_size_is_checked_before_the_picture_is_decoded(
    build_ros2: Any, suffix: str, width: int, height: int
) -> None:
    encoded = cv2.imencode(suffix, np.zeros((16, 16, 3), np.uint8))[1].tobytes()
    message = build_ros2.compressed(resized(encoded, width, height))
    with pytest.raises(RecordingError, match=f"{width}x{height} pixels"):
        decode_image(message, COMPRESSED, "/camera")


def test_depth_images_are_refused_by_name(build_ros2: Any) -> None:
    depth = cv2.imencode(".png", np.zeros((4, 4), np.uint16))[1].tobytes()
    with pytest.raises(RecordingError, match="compressedDepth"):
        decode_image(build_ros2.compressed(bytes(12) + depth), COMPRESSED, "/depth")


@pytest.mark.parametrize(
    "data", [b"", b"GIF89a..", b"\xff\xd8\xff", b"\x89PNG\r\n\x1a\n", bytes(99)]
)
def test_what_is_no_picture_is_refused(build_ros2: Any, data: bytes) -> None:
    with pytest.raises(RecordingError, match=r"neither a JPEG|damaged"):
        decode_image(build_ros2.compressed(data), COMPRESSED, "/camera")


@given(st.integers(0, 600), st.sampled_from([".jpg", ".png"]))
def test_a_cut_file_is_refused(build_ros2: Any, size: int, suffix: str) -> None:
    noise = np.random.default_rng(1).integers(0, 256, (16, 16, 3), np.uint8)
    encoded = cv2.imencode(suffix, noise)[1].tobytes()[:size]
    with pytest.raises(RecordingError):
        decode_image(build_ros2.compressed(encoded), COMPRESSED, "/camera")


@given(st.lists(st.tuples(st.integers(0, 10_000), st.integers(0, 255)), min_size=1, max_size=8))
def test_a_damaged_jpeg_gives_a_picture_or_one_clear_error(
    build_ros2: Any, changes: list[tuple[int, int]]
) -> None:
    noise = np.random.default_rng(1).integers(0, 256, (16, 16, 3), np.uint8)
    encoded = bytearray(cv2.imencode(".jpg", noise)[1].tobytes())
    for position, value in changes:
        encoded[position % len(encoded)] = value
    try:
        rgb = decode_image(build_ros2.compressed(bytes(encoded)), COMPRESSED, "/camera").rgb
    except RecordingError:
        return
    assert rgb.dtype == np.uint8
    assert rgb.shape[2] == 3


def test_another_type_is_refused(build_ros2: Any) -> None:
    with pytest.raises(RecordingError, match="is no picture"):
        decode_image(build_ros2.compressed(b""), "sensor_msgs/msg/PointCloud2", "/points")


@pytest.mark.parametrize(
    ("name", "topic", "size"),
    [
        ("rosnumpy_rgb8_cloud15.bag", "/image", (240, 360)),
        ("rosnumpy_rgb8_cloud15.bag", "/compressedimage", None),
        ("fiducials_jpg_camera_info.bag", "/raspicam_node/image/compressed", (960, 1280)),
        ("rerun_rosbag2_image_cloud_scan.mcap", "/image", (480, 640)),
        ("rerun_rosbag2_image_cloud_scan.mcap", "/compressed_image", None),
    ],
)
def test_real_pictures(
    real_messages: Callable[[str, str], Any], name: str, topic: str, size: tuple[int, int] | None
) -> None:
    pictures = [decode_image(message, kind, topic) for message, kind in real_messages(name, topic)]
    assert pictures
    for picture in pictures:
        assert size is None or picture.rgb.shape == (*size, 3)
        assert picture.rgb.std() > 10
