from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from graspe_data.errors import RecordingError
from graspe_data.recordings.decoding import decode_calibration
from graspe_data.robot import Intrinsics

K = [500.0, 0.0, 320.0, 0.0, 510.0, 240.0, 0.0, 0.0, 1.0]
P = [480.0, 0.0, 310.0, 0.0, 0.0, 490.0, 230.0, 0.0, 0.0, 0.0, 1.0, 0.0]


def camera_info(build: Any, model: str, coefficients: list[float], **changes: Any) -> Any:
    values = {"k": np.array(K), "d": np.array(coefficients), "r": np.eye(3).ravel()}
    values["p"] = np.array(P)
    if build.generation == "ros1":
        values = {name.upper(): value for name, value in values.items()}
    roi = {"x_offset": 0, "y_offset": 0, "height": 0, "width": 0, "do_rectify": False}
    roi |= changes.pop("roi", {})
    fields = {"width": 640, "height": 480, "binning_x": 0, "binning_y": 0, **changes}
    return build(
        "sensor_msgs/msg/CameraInfo",
        header=build.header("camera_optical"),
        distortion_model=model,
        roi=build("sensor_msgs/msg/RegionOfInterest", **roi),
        **values,
        **fields,
    )


def intrinsics(build: Any, model: str, coefficients: list[float], **changes: Any) -> Intrinsics:
    return decode_calibration(camera_info(build, model, coefficients, **changes), "/i").intrinsics


@pytest.mark.parametrize(
    ("published", "coefficients", "model", "kept"),
    [
        ("plumb_bob", 5, "plumb_bob", 5),
        ("plumb_bob", 4, "plumb_bob", 4),
        ("rational_polynomial", 8, "rational_polynomial", 8),
        ("rational_polynomial", 14, "rational_polynomial", 14),
        ("equidistant", 4, "equidistant", 4),
        ("fisheye", 4, "equidistant", 4),
    ],
)
def test_the_distortion_models_of_opencv(
    build: Any, published: str, coefficients: int, model: str, kept: int
) -> None:
    values = [0.01 * (i + 1) for i in range(coefficients)]
    expected = Intrinsics(
        width=640,
        height=480,
        fx=500,
        fy=510,
        cx=320,
        cy=240,
        distortion_model=model,
        distortion=tuple(values[:kept]),
    )
    assert intrinsics(build, published, values) == expected


def test_the_stamp_and_the_frame_are_those_of_the_header(build: Any) -> None:
    calibration = decode_calibration(camera_info(build, "plumb_bob", []), "/i")
    assert (calibration.stamp_ns, calibration.frame) == (12_000_000_034, "camera_optical")


@pytest.mark.parametrize("model", ["plumb_bob", "", "none", "kannala"])
@pytest.mark.parametrize("count", [0, 5])
def test_no_coefficients_are_no_distortion(build: Any, model: str, count: int) -> None:
    found = intrinsics(build, model, [0.0] * count)
    assert (found.distortion_model, found.distortion) == ("none", ())


def test_zeros_after_the_coefficients_are_dropped(build: Any) -> None:
    assert intrinsics(build, "plumb_bob", [0.1, 0, 0, 0, 0, 0, 0, 0]).distortion == (
        0.1,
        0,
        0,
        0,
        0,
    )


@pytest.mark.parametrize(
    ("model", "coefficients", "fault"),
    [
        ("kannala", [0.1], "'kannala' is not known"),
        ("", [0.1], "'' is not known"),
        ("plumb_bob", [0.1] * 8, "takes 4 or 5 finite coefficients"),
        ("plumb_bob", [0.1] * 3, "takes 4 or 5"),
        ("equidistant", [0.1, 0.1, 0.1, np.nan], "takes 4 finite"),
    ],
)
def test_a_distortion_that_is_unknown_is_refused(
    build: Any, model: str, coefficients: list[float], fault: str
) -> None:
    with pytest.raises(RecordingError, match=fault):
        intrinsics(build, model, coefficients)


def test_binning_and_region_of_interest_are_applied(build: Any) -> None:
    roi = {"x_offset": 100, "y_offset": 40, "width": 400, "height": 300}
    found = intrinsics(build, "plumb_bob", [], binning_x=2, binning_y=2, roi=roi)
    assert (found.width, found.height) == (200, 150)
    assert (found.fx, found.fy, found.cx, found.cy) == (250, 255, 110, 100)


def test_rectified_pictures_take_the_projection_matrix(build: Any) -> None:
    message = camera_info(build, "plumb_bob", [0.1] * 5)
    found = decode_calibration(message, "/i", rectified=True).intrinsics
    assert (found.fx, found.fy, found.cx, found.cy) == (480, 490, 310, 230)
    assert found.distortion_model == "none"


def test_a_camera_that_is_not_calibrated_is_refused(build: Any) -> None:
    message = camera_info(build, "plumb_bob", [])
    setattr(message, "K" if build.generation == "ros1" else "k", np.zeros(9))
    with pytest.raises(RecordingError, match=r"/i, .* not calibrated"):
        decode_calibration(message, "/i")


def test_a_calibration_without_a_size_is_refused(build: Any) -> None:
    with pytest.raises(RecordingError, match="0x480 pixels"):
        intrinsics(build, "plumb_bob", [], width=0)


@pytest.mark.parametrize(
    ("name", "topic", "fx", "model"),
    [
        ("fiducials_jpg_camera_info.bag", "/raspicam_node/camera_info", 1014.3, "plumb_bob"),
        (
            "kitti_street_camera_lidar_odometry",
            "/kitti/camera_color_left/camera_info",
            721.54,
            "none",
        ),
    ],
)
def test_real_calibrations(
    real_messages: Callable[[str, str], Any], name: str, topic: str, fx: float, model: str
) -> None:
    message, _ = next(iter(real_messages(name, topic)))
    found = decode_calibration(message, topic).intrinsics
    assert found.fx == pytest.approx(fx, abs=0.1)
    assert found.distortion_model == model
