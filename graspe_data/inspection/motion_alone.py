"""Each odometry topic by itself: whether it says the same thing twice, rows or no rows."""

from __future__ import annotations

import numpy as np

from graspe_data.errors import RecordingError
from graspe_data.geometry import plain_frame
from graspe_data.inspection.survey import Survey
from graspe_data.recordings.decoding import decode_motion
from graspe_data.recordings.recording import Recording
from graspe_data.robot import Footprint, Robot, Topics
from graspe_data.synchronisation.findings import Course, Finding
from graspe_data.synchronisation.motion_samples import driven_limits, motion_samples
from graspe_data.synchronisation.odometry import build_odometry
from graspe_data.synchronisation.pose_jumps import cut_at_jumps
from graspe_data.synchronisation.tracks import MotionTrack, StampTrack

ODOMETRY = "nav_msgs/msg/Odometry"
_NONE = (float("nan"),)


def other_motion(recording: Recording, survey: Survey, chosen: str | None) -> list[Finding]:
    """What the odometry topics say that rows are not made of; ``chosen`` is left out."""
    topics = [
        name
        for name, topic in survey.serving("odometry").items()
        if name != chosen and topic.info.message_type == ODOMETRY
    ]
    return [finding for topic in topics for finding in _motion_of(recording, topic)]


def _motion_of(recording: Recording, topic: str) -> list[Finding]:
    findings: list[Finding] = []
    try:
        track = _track(recording, topic)
        robot = _anything(topic, track)
        stamps = track.stamps.header_ns
        times = track.stamps.bag_ns if stamps is None or not stamps.any() else stamps
        samples = cut_at_jumps(motion_samples(track, times), robot.limits)
        build_odometry([samples], robot, None, findings)
    except RecordingError as error:
        findings.append(Finding("motion_contradicts", "noted", topic, str(error)))
    return [_named(finding, topic) for finding in findings]


def _named(finding: Finding, topic: str) -> Finding:
    """The finding with its topic, and without a word of rows: none are made of it."""
    text = finding.text if finding.text.startswith(topic) else f"{topic}: {finding.text}"
    course: Course = "noted" if finding.course == "mended" else finding.course
    text = text.replace("No rows are made. ", "")
    return Finding(finding.kind, course, topic, f"{text} (not used)", finding.numbers)


def _track(recording: Recording, topic: str) -> MotionTrack:
    stamps: list[int] = []
    bags: list[int] = []
    rows: list[tuple[float, ...]] = []
    frames = set()
    for raw in recording.messages([topic]):
        try:
            motion = decode_motion(recording.decode(raw), ODOMETRY, topic)
        except RecordingError:
            continue
        stamps.append(motion.stamp_ns or 0)
        bags.append(raw.bag_time_ns)
        pose = (*(motion.position or _NONE * 3), *(motion.quaternion or _NONE * 4))
        rows.append((*pose, *(motion.twist or _NONE * 6)))
        frames.add((plain_frame(motion.frame), plain_frame(motion.child_frame)))
    table = np.array(rows, np.float64).reshape(-1, 13)
    bag_ns = np.array(bags, np.int64)
    track = StampTrack(topic, np.array(stamps, np.int64), bag_ns, np.arange(bag_ns.size))
    frame, child = min(frames, default=("", ""))
    return MotionTrack(track, table[:, :3], table[:, 3:7], table[:, 7:], frame, child)


def _anything(topic: str, track: MotionTrack) -> Robot:
    """A robot that may do what was done."""
    return Robot(
        name="any",
        topics=Topics(image="/image", points="/points", odometry=topic),
        limits=driven_limits(track),
        footprint=Footprint(length=1.0, width=0.6),
    )
