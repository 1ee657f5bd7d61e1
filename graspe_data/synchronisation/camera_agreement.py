"""Whether a CameraInfo and the pictures beside it are of one camera, and face along its axis."""

from __future__ import annotations

import re
from collections.abc import Collection
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from graspe_data.geometry import plain_frame
from graspe_data.robot import Intrinsics
from graspe_data.synchronisation.findings import Finding

SIZE: Final = "camera_size"
FRAME: Final = "camera_frame"
OPTICAL: Final = "optical_frame"
NAME: Final = "camera_name"
# Shares of an axis that point down or up: a camera that looks 70 degrees down has y down by .34.
_ASKEW: Final = 0.3
_CLEAR: Final = 0.5
_SAME_ASPECT: Final = 0.01
_WHAT: Final = ("image", "compressed", "h264", "h265", "hevc", "ffmpeg", "video", "camera_info")
_PLAIN: Final = frozenset({"", "link", "frame", "optical", "color", "colour", "rgb"})
_OTHER_SENSOR: Final = ("depth", "infra", "left", "right", "rear", "back", "front", "side")


@dataclass(frozen=True)
class Pictures:
    """The pictures of a topic: size in pixels, and the frame of their headers."""

    topic: str
    width: int
    height: int
    frame: str


@dataclass(frozen=True)
class Calibrated:
    """A CameraInfo: its topic, the frame of its header, intrinsics after binning and region.

    ``full_size`` is (width, height) as its message says, before binning and region of interest.
    """

    topic: str
    frame: str
    intrinsics: Intrinsics
    full_size: tuple[int, int] | None = None


def camera_findings(
    pictures: Pictures,
    calibrated: Calibrated | None,
    base_from_camera: NDArray[np.float64] | None = None,
    frames: Collection[str] = (),
    *,
    chosen_frame: str | None = None,
) -> list[Finding]:
    """Hold pictures against their CameraInfo, and their frame against the robot.

    Args:
        pictures: Of the image topic.
        calibrated: Of the camera_info topic; None where there is none.
        base_from_camera: Rotation (3, 3) that carries vectors of the pictures' frame into the base
            (x ahead, z up), or those of ``chosen_frame``; None where it is not known.
        frames: The frames of the recording, of which an optical one is proposed.
        chosen_frame: ``camera.frame`` of the manifest, which counts in place of the pictures'.

    Returns:
        What agrees and what does not, in the order size, frame, name, axes.
    """
    findings: list[Finding] = []
    if calibrated is not None:
        findings.append(_size(pictures, calibrated))
        findings.append(_frame(pictures, calibrated, chosen_frame))
        findings += _names(pictures, calibrated)
    if base_from_camera is not None:
        frame = plain_frame(chosen_frame or pictures.frame)
        findings.append(_axes(pictures, frame, base_from_camera, frames))
    return findings


def _size(pictures: Pictures, calibrated: Calibrated) -> Finding:
    declared = (calibrated.intrinsics.width, calibrated.intrinsics.height)
    seen = (pictures.width, pictures.height)
    numbers = {
        "picture_width": float(seen[0]),
        "picture_height": float(seen[1]),
        "calibrated_width": float(declared[0]),
        "calibrated_height": float(declared[1]),
    }
    if declared == seen:
        text = f"The pictures and {calibrated.topic} are both {_by(seen)}."
        return Finding(SIZE, "agrees", pictures.topic, text, numbers)
    text = (
        f"The pictures are {_by(seen)}, {calibrated.topic} is for {_by(declared)}"
        f"{_whole(calibrated, declared)}. {_advice(seen, declared, calibrated)}"
    )
    return Finding(SIZE, "refused", pictures.topic, text, numbers)


def _whole(calibrated: Calibrated, declared: tuple[int, int]) -> str:
    full = calibrated.full_size
    if full is None or full == declared:
        return ""
    return f" (after binning and region of interest of {_by(full)})"


def _advice(seen: tuple[int, int], declared: tuple[int, int], calibrated: Calibrated) -> str:
    if seen == calibrated.full_size:
        return (
            "The pictures are whole: the driver announces a binning or a region of interest that "
            "it does not apply. Give `camera.intrinsics` with the values of K as they are."
        )
    across, down = seen[0] / declared[0], seen[1] / declared[1]
    if abs(across / down - 1.0) <= _SAME_ASPECT:
        k = calibrated.intrinsics
        matrix = (
            f"fx {k.fx * across:.2f}, fy {k.fy * down:.2f}, cx {(k.cx + 0.5) * across - 0.5:.2f}, "
            f"cy {(k.cy + 0.5) * down - 0.5:.2f}"
        )
        return (
            f"The sides are as one to another ({across:.3g} times): if the driver only scales its "
            f"pictures, give `camera.intrinsics` of {_by(seen)} with {matrix} and the same "
            f"distortion."
        )
    if seen == (declared[1], declared[0]):
        return (
            "Width and height are exchanged: the pictures were turned after calibration. Record "
            "them as the sensor gives them, or give `camera.intrinsics` of the turned pictures."
        )
    return (
        "The sides have another aspect: the pictures are cropped, or of another camera or mode. "
        "Name the CameraInfo of these pictures as `camera_info`, or give `camera.intrinsics`."
    )


def _frame(pictures: Pictures, calibrated: Calibrated, chosen: str | None) -> Finding:
    seen, declared = plain_frame(pictures.frame), plain_frame(calibrated.frame)
    if seen == declared:
        text = f"The pictures and {calibrated.topic} are both in frame '{seen}'."
        return Finding(FRAME, "agrees", pictures.topic, text)
    counts = chosen or seen
    text = (
        f"The pictures are in frame '{seen}', {calibrated.topic} in frame '{declared}': both "
        f"should name the camera's optical frame. '{counts}' counts; set `camera.frame` to choose, "
        f"or name the CameraInfo of this camera as `camera_info`."
    )
    return Finding(FRAME, "noted", pictures.topic, text)


def _names(pictures: Pictures, calibrated: Calibrated) -> list[Finding]:
    """A finding where the names say two cameras."""
    ours, theirs = _camera_of(pictures.topic), _camera_of(calibrated.topic)
    shorter, longer = sorted((ours, theirs), key=len)
    more = longer[len(shorter) :]
    beside = longer[: len(shorter)] == shorter and not any(
        word in part for part in more for word in _OTHER_SENSOR
    )
    if beside or (not shorter and not more):
        return []
    text = (
        f"The pictures are of camera '/{'/'.join(ours)}', {calibrated.topic} is of camera "
        f"'/{'/'.join(theirs)}': K and the distortion may be another camera's. Name the CameraInfo "
        f"beside the pictures as `camera_info`."
    )
    return [Finding(NAME, "noted", pictures.topic, text)]


def _camera_of(topic: str) -> list[str]:
    """The parts of a name that say which camera, without those that say what of it."""
    parts = [part for part in topic.split("/") if part]
    while parts and parts[-1].startswith(_WHAT):
        parts.pop()
    return parts


def _axes(
    pictures: Pictures, frame: str, rotation: NDArray[np.float64], frames: Collection[str]
) -> Finding:
    """Tell an optical frame (z ahead, y down) from a body's (x ahead, z up) by its axes."""
    ahead, down, up = float(rotation[0, 0]), float(-rotation[2, 1]), float(rotation[2, 2])
    numbers = {"x_ahead": ahead, "y_down": down, "z_up": up}
    where = pictures.topic
    if down > _ASKEW and up < down:
        text = f"Frame '{frame}' is an optical frame: its y points down within {_degrees(down)}."
        return Finding(OPTICAL, "agrees", where, text, numbers)
    if is_body_frame(rotation):
        text = (
            f"Frame '{frame}' is no optical frame: its z points up within {_degrees(up)}, as a "
            f"body's does; an optical frame has z ahead and y down. {_proposal(frame, frames)}"
        )
        return Finding(OPTICAL, "refused", where, text, numbers)
    if down < -_CLEAR:
        text = (
            f"Frame '{frame}' is an optical frame upside down: its y points up within "
            f"{_degrees(-down)}. If the driver turns its pictures upright, give `camera.mounting` "
            f"of a camera that stands upright."
        )
        return Finding(OPTICAL, "noted", where, text, numbers)
    text = (
        f"Frame '{frame}' has {down:.2f} of its y down and {up:.2f} of its z up; an optical frame "
        f"has z ahead and y down. Either the camera looks steeply down or up or lies on its side, "
        f"or this frame is no camera's. {_proposal(frame, frames)}"
    )
    return Finding(OPTICAL, "noted", where, text, numbers)


def likely_optical(frame: str, frames: Collection[str]) -> str | None:
    """The frame named as optical that is most like a camera's; None where none is."""
    optical = sorted(name for name in map(plain_frame, frames) if "optical" in name.lower())
    optical = [name for name in optical if name != frame]
    return min(optical, key=lambda name: _unlikeness(name, frame), default=None)


def is_body_frame(rotation: NDArray[np.float64]) -> bool:
    """Whether a frame, turned so (3, 3) in the base, has z up as a body's, and not y down."""
    return float(rotation[2, 2]) > _CLEAR and abs(float(rotation[2, 1])) <= _CLEAR


def _proposal(frame: str, frames: Collection[str]) -> str:
    likely = likely_optical(frame, frames)
    if likely is None:
        return (
            "No frame of the recording is named as optical: give `camera.mounting` in the robot "
            "manifest, or set `camera.frame` to the camera's optical frame."
        )
    return f"Set `camera.frame: {likely}`."


def _unlikeness(name: str, frame: str) -> tuple[bool, float, int, str]:
    """Ranks a name by how much less it shares with a frame's, and another sensor's last."""
    ours, theirs = (set(re.split(r"[_/\W]+", text.lower())) - _PLAIN for text in (frame, name))
    other = any(word in part for part in theirs - ours for word in _OTHER_SENSOR)
    shared = len(ours & theirs) / max(len(ours | theirs), 1)
    return other, -shared, len(name), name


def _degrees(cosine: float) -> str:
    return f"{np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0))):.0f} degrees"


def _by(size: tuple[int, int]) -> str:
    return f"{size[0]}x{size[1]}"
