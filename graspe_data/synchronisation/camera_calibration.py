"""The calibration of a recording's pictures: the manifest's, or that of its CameraInfo."""

from __future__ import annotations

from pathlib import Path

from graspe_data.errors import RecordingError
from graspe_data.robot import Intrinsics, Robot
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
