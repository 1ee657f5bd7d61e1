"""A CameraInfo is held against the pictures, and their frame against the robot."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from graspe_data.geometry import rotation_from_rpy
from graspe_data.robot import Intrinsics
from graspe_data.synchronisation.camera_agreement import Calibrated, Pictures, camera_findings
from graspe_data.synchronisation.findings import Finding

HD = Intrinsics(width=1280, height=960, fx=800.0, fy=810.0, cx=639.5, cy=479.5)
# Carries an optical frame (z ahead, y down) into a body's (x ahead, z up).
OPTICAL = rotation_from_rpy(-np.pi / 2, 0.0, -np.pi / 2)


def pictures(
    width: int = 1280, height: int = 960, frame: str = "eye", topic: str = "/cam/image_raw"
) -> Pictures:
    return Pictures(topic, width, height, frame)


def info(
    frame: str = "eye",
    topic: str = "/cam/camera_info",
    intrinsics: Intrinsics = HD,
    full: tuple[int, int] | None = None,
) -> Calibrated:
    return Calibrated(topic, frame, intrinsics, full)


def only(findings: list[Finding], kind: str) -> Finding:
    (found,) = [finding for finding in findings if finding.kind == kind]
    return found


def test_what_agrees_is_said() -> None:
    findings = camera_findings(pictures(), info(), OPTICAL)
    assert [f.kind for f in findings] == ["camera_size", "camera_frame", "optical_frame"]
    assert {f.course for f in findings} == {"agrees"}
    assert "both 1280x960" in findings[0].text


def test_a_slash_before_a_frame_is_no_difference() -> None:
    assert only(camera_findings(pictures(frame="/eye"), info()), "camera_frame").course == "agrees"


def test_without_calibration_or_mounting_nothing_is_held() -> None:
    assert camera_findings(pictures(), None) == []


@pytest.mark.parametrize(
    ("size", "advice"),
    [
        ((640, 480), "fx 400.00, fy 405.00, cx 319.50, cy 239.50"),
        ((2560, 1920), "(2 times)"),
        ((960, 1280), "Width and height are exchanged"),
        ((1280, 720), "another aspect"),
        ((640, 360), "another aspect"),
    ],
)
def test_another_size_is_refused_with_advice(size: tuple[int, int], advice: str) -> None:
    finding = only(camera_findings(pictures(*size), info()), "camera_size")
    assert finding.course == "refused"
    assert f"pictures are {size[0]}x{size[1]}, /cam/camera_info is for 1280x960" in finding.text
    assert advice in finding.text
    assert finding.numbers["picture_width"] == size[0]


def test_a_binning_that_the_driver_did_not_apply_is_named() -> None:
    half = HD.model_copy(update={"width": 640, "height": 480})
    finding = only(
        camera_findings(pictures(), info(intrinsics=half, full=(1280, 960))), "camera_size"
    )
    assert "after binning and region of interest of 1280x960" in finding.text
    assert "that it does not apply" in finding.text


def test_another_frame_is_named_with_both() -> None:
    finding = only(
        camera_findings(pictures(frame="left_optical"), info(frame="right_optical")),
        "camera_frame",
    )
    assert finding.course == "noted"
    assert "'left_optical'" in finding.text
    assert "'right_optical'" in finding.text


@pytest.mark.parametrize(
    ("image", "camera_info"),
    [
        ("/camera/color/image_raw", "/camera/depth/camera_info"),
        ("/camera/image_raw", "/camera/depth/camera_info"),
        ("/stereo/left/image_rect", "/stereo/right/camera_info"),
        ("/robot1/cam/image_raw/compressed", "/robot2/cam/camera_info"),
        ("/front/image_raw", "/camera_rear/camera_info"),
    ],
)
def test_the_info_of_another_camera_is_named(image: str, camera_info: str) -> None:
    finding = only(camera_findings(pictures(topic=image), info(topic=camera_info)), "camera_name")
    assert finding.course == "noted"
    assert camera_info in finding.text


@pytest.mark.parametrize(
    ("image", "camera_info"),
    [
        ("/image_raw", "/camera_info"),
        ("/camera/image_raw/compressed", "/camera/camera_info"),
        ("/camera/color/image_raw", "/camera/color/camera_info"),
        ("/camera/rgb/image_rect_color", "/camera/rgb/camera_info"),
        ("/camera/rgb", "/camera/camera_info"),
        ("/cam/h264", "/cam/camera_info"),
        ("/multisense/left/image_rect_color", "/multisense/left/image_rect_color/camera_info"),
    ],
)
def test_the_info_beside_the_pictures_is_theirs(image: str, camera_info: str) -> None:
    found = camera_findings(pictures(topic=image), info(topic=camera_info))
    assert not [finding for finding in found if finding.kind == "camera_name"]


def axes(rotation: np.ndarray[tuple[int, ...], np.dtype[np.float64]], *frames: str) -> Finding:
    found = camera_findings(pictures(frame="camera_link"), None, rotation, frames)
    return only(found, "optical_frame")


@given(
    pitch=st.floats(-0.7, 1.2),
    yaw=st.floats(-3.1, 3.1),
    roll=st.floats(-0.3, 0.3),
)
def test_an_optical_frame_is_one_whichever_way_the_camera_looks(
    pitch: float, yaw: float, roll: float
) -> None:
    assert axes(rotation_from_rpy(roll, pitch, yaw) @ OPTICAL).course == "agrees"


@given(
    pitch=st.floats(-0.9, 0.9),
    yaw=st.floats(-3.1, 3.1),
    roll=st.floats(-0.3, 0.3),
)
def test_a_body_frame_is_no_optical_frame(pitch: float, yaw: float, roll: float) -> None:
    finding = axes(rotation_from_rpy(roll, pitch, yaw), "base_link")
    assert finding.course == "refused"
    assert "'camera_link' is no optical frame" in finding.text


def test_the_likeliest_optical_frame_is_proposed() -> None:
    frames = ("base_link", "rear_optical_frame", "camera_optical_frame", "/camera_depth_optical")
    finding = axes(np.eye(3), *frames)
    assert "Set `camera.frame: camera_optical_frame`." in finding.text


def test_without_an_optical_frame_the_mounting_is_asked_for() -> None:
    assert "give `camera.mounting`" in axes(np.eye(3), "base_link", "camera_link").text


@pytest.mark.parametrize(
    ("turn", "said"),
    [
        ((np.pi, 0.0, 0.0), "upside down"),
        ((np.pi / 2, 0.0, 0.0), "lies on its side"),
        ((0.0, np.pi / 2, 0.0), "looks steeply down"),
    ],
)
def test_a_camera_in_another_pose_is_noted(turn: tuple[float, float, float], said: str) -> None:
    finding = axes(rotation_from_rpy(*turn) @ OPTICAL)
    assert finding.course == "noted"
    assert said in finding.text


def test_the_chosen_frame_is_the_one_that_counts() -> None:
    found = camera_findings(pictures(), info(), OPTICAL, chosen_frame="eye_optical")
    assert "'eye_optical' is an optical frame" in only(found, "optical_frame").text
