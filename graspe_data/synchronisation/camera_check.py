"""The camera of a recording: its calibration, and what that and its frame say of the pictures."""

from __future__ import annotations

from pathlib import Path

from graspe_data.calibration import declared_mounting
from graspe_data.errors import RecordingError
from graspe_data.robot import Intrinsics, Robot
from graspe_data.synchronisation.camera_agreement import Calibrated, Pictures, camera_findings
from graspe_data.synchronisation.findings import Finding
from graspe_data.synchronisation.placement import Placement
from graspe_data.synchronisation.tracks import Tracks


def camera_intrinsics(tracks: Tracks, robot: Robot, path: Path | str = "") -> Intrinsics:
    """The intrinsics that count.

    Args:
        tracks: Of the first pass.
        robot: Its manifest.
        path: The recording, named in the error.

    Raises:
        RecordingError: Neither gives any.
    """
    declared = robot.camera.intrinsics
    if isinstance(declared, Intrinsics):
        return declared
    if tracks.calibration is not None:
        return tracks.calibration.intrinsics
    topic = robot.topics.camera_info
    faults = [
        loss.reason for loss in tracks.losses if loss.topic is not None and loss.topic == topic
    ]
    why = f" ({faults[0]})" if faults else ""
    raise RecordingError(
        f"{path}: no CameraInfo on {topic or 'any declared topic'}{why}. Name its topic under "
        f"`topics.camera_info`, or give `camera.intrinsics`, in the robot manifest."
    )


def check_camera(tracks: Tracks, placement: Placement) -> list[Finding]:
    """What disagrees between pictures, calibration and frames.

    Raises:
        RecordingError: The calibration is for pictures of another size, or the camera's frame is
            that of a body.
    """
    camera, frame = placement.robot.camera, tracks.image_frame
    width, height = tracks.picture_size or (0, 0)
    pictures = Pictures(tracks.image.topic, width, height, frame)
    by_tf = declared_mounting(placement.robot, "camera") is None
    rotation = placement.camera_mountings(frame)[-1][1].rotation if by_tf else None
    found = camera_findings(
        pictures,
        _calibrated(tracks, placement),
        rotation,
        placement.transforms.frames,
        chosen_frame=camera.frame,
    )
    refused = [finding for finding in found if finding.course == "refused"]
    if refused:
        raise RecordingError(f"{refused[0].where}: {refused[0].text}")
    return [finding for finding in found if finding.course != "agrees"]


def _calibrated(tracks: Tracks, placement: Placement) -> Calibrated | None:
    """The CameraInfo, where it counts and a picture's size is known."""
    topic, calibration = placement.robot.topics.camera_info, tracks.calibration
    declared = isinstance(placement.robot.camera.intrinsics, Intrinsics)
    if topic is None or calibration is None or declared or tracks.picture_size is None:
        return None
    return Calibrated(topic, tracks.camera_info_frame, calibration.intrinsics)
