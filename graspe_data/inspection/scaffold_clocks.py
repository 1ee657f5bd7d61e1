"""The lines of a starting manifest about clocks."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from graspe_data.errors import RecordingError
from graspe_data.inspection.evidence import Evidence
from graspe_data.inspection.manifest_lines import ManifestLine
from graspe_data.inspection.roles import Role
from graspe_data.robot import Clock
from graspe_data.synchronisation.clocks import SECOND, ClockSettings, camera_timeline, timeline
from graspe_data.synchronisation.tracks import StampTrack

LARGEST_UNDECLARED_SKEW_S: Final = 1.0
Lines = Iterator[ManifestLine]


def clock_lines(evidence: Evidence) -> Lines:
    """Offsets of the topics whose clock is not the camera's."""
    if evidence.topic("image") is None:
        return
    roles: tuple[Role, ...] = ("points", "odometry")
    found = [line for role in roles for line in _clock(evidence, role)]
    if found:
        yield ManifestLine(0, "clocks")
        yield from found


def _clock(evidence: Evidence, role: Role) -> Lines:
    """An offset where the skew against the camera is constant and large."""
    camera, track = chosen_track(evidence, "image"), chosen_track(evidence, role)
    if camera is None or track is None:
        return
    measured, limits = Clock(offset_s="measured"), ClockSettings()
    try:
        camera_time = camera_timeline(camera, Clock())
        offset = timeline(track, measured, camera, camera_time, limits).offset_ns / SECOND
    except RecordingError as error:
        yield ManifestLine(1, role, "{}", f"missing: {error}")
        return
    if abs(offset) > LARGEST_UNDECLARED_SKEW_S:
        yield ManifestLine(1, role)
        note = "guess: the constant difference to the camera's skew, if they ran together"
        yield ManifestLine(2, "offset_s", round(offset, 3), note)


def chosen_track(evidence: Evidence, role: Role) -> StampTrack | None:
    """The stamps of the topic chosen for a role; of odometry by tf, those of its edge."""
    topic = evidence.topic(role)
    if topic is not None and role == "odometry" and "tf" in topic.roles:
        edge = (evidence.choice.odometry_frame, evidence.choice.base_frame)
        return evidence.survey.moving.get(edge, topic.stamps)
    return None if topic is None else topic.stamps
