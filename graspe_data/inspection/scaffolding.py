"""A robot manifest to start from, written from what a recording says."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Final

from graspe_data.errors import RecordingError
from graspe_data.inspection.evidence import Evidence, gather_evidence
from graspe_data.inspection.known_robots import suggested_robots
from graspe_data.inspection.manifest_lines import ManifestLine, manifest_text
from graspe_data.inspection.roles import Role
from graspe_data.inspection.scaffold_clocks import clock_lines
from graspe_data.inspection.scaffold_motion import frame_lines, limit_lines, motion_lines
from graspe_data.inspection.scaffold_sensors import camera_lines, lidar_lines
from graspe_data.inspection.survey import survey_recording
from graspe_data.recordings.recording import open_recording

Lines = Iterator[ManifestLine]

PLACEHOLDER: Final = "/fill_in/"
_NEEDED: Final[tuple[Role, ...]] = ("image", "points", "odometry")
_OPTIONAL: Final[tuple[Role, ...]] = ("camera_info", "command", "imu")


def scaffold_robot(path: Path, *, resolve: bool = False) -> str:
    """Write a starting robot manifest, YAML, that loads as it stands.

    A value is followed by where it was found; by ``guess:`` and its ground; or by ``missing:`` and
    what to fill in.

    Args:
        path: The recording.
        resolve: Write mountings and intrinsics as numbers, not as where the recording has them.

    Raises:
        RecordingError: The recording cannot be read, or has no messages.
    """
    with open_recording(path) as recording:
        survey = survey_recording(recording)
        if not any(topic.count for topic in survey.topics.values()):
            raise RecordingError(f"{path}: no messages, so nothing to start a robot manifest from.")
        evidence = gather_evidence(recording, survey, None)
    lines = list(_lines(evidence, path, resolve=resolve))
    return manifest_text(path.name, lines, [_like(name) for name, _ in suggested_robots(survey)])


def _like(robot: str) -> str:
    return f"Its topics are those of {robot}, which ships: `graspe inspect --robot {robot}`."


def _lines(evidence: Evidence, path: Path, *, resolve: bool) -> Lines:
    name = re.sub(r"[^a-z0-9]+", "_", path.name.split(".")[0].lower()).strip("_")
    yield ManifestLine(0, "name", name or "robot", "guess: the recording's name")
    yield from _topic_lines(evidence)
    yield from frame_lines(evidence)
    yield from motion_lines(evidence)
    yield from camera_lines(evidence, resolve=resolve)
    yield from lidar_lines(evidence, resolve=resolve)
    yield from clock_lines(evidence)
    yield from limit_lines(evidence)
    note = "missing: measure the robot; the width is also that of the drawn trajectory"
    yield ManifestLine(0, "footprint", None, note)
    yield ManifestLine(1, "length", 1.0, "missing: metres")
    yield ManifestLine(1, "width", 0.6, "missing: metres")


def _topic_lines(evidence: Evidence) -> Lines:
    yield ManifestLine(0, "topics")
    for role in _NEEDED:
        yield _topic_line(evidence, role) or ManifestLine(
            1, role, PLACEHOLDER + role, "missing: no topic of the recording could serve"
        )
    for role in _OPTIONAL:
        line = _topic_line(evidence, role)
        if line is not None:
            yield line


def _topic_line(evidence: Evidence, role: Role) -> ManifestLine | None:
    topic = evidence.topic(role)
    if topic is None:
        return None
    name, others = topic.info.name, set(evidence.survey.serving(role)) - {topic.info.name}
    found = f"{topic.count} {topic.info.message_type}"
    note = f"guess: {found}; or {', '.join(sorted(others))}" if others else f"found: {found}"
    return ManifestLine(1, role, name, note)
