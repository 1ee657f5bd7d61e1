"""What a recording says once the planner of rows was asked, by a manifest or by the best guess."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Final

import numpy as np

from graspe_data.errors import RecordingError
from graspe_data.inspection.motion_alone import other_motion
from graspe_data.inspection.roles import Role
from graspe_data.inspection.survey import Survey, TopicSurvey
from graspe_data.inspection.topic_choice import (
    NEEDED,
    TopicChoice,
    declared_topics,
    guessed_topics,
)
from graspe_data.recordings.recording import Recording
from graspe_data.robot import Camera, Footprint, Intrinsics, Lidar, Limits, Mounting, Robot, Topics
from graspe_data.synchronisation.camera_agreement import is_body_frame, likely_optical
from graspe_data.synchronisation.clocks import ClockSettings
from graspe_data.synchronisation.edges import sort_edges
from graspe_data.synchronisation.findings import Finding
from graspe_data.synchronisation.motion_samples import driven_limits
from graspe_data.synchronisation.odometry_from_tf import moving_edge, odometry_from_tf
from graspe_data.synchronisation.row_plan import SynchronisationSettings
from graspe_data.synchronisation.synchronised import (
    SynchronisedRecording,
    read_all_tracks,
    synchronise_tracks,
)
from graspe_data.synchronisation.tracks import MotionTrack, Tracks
from graspe_data.synchronisation.transform_buffer import MovingEdge, TransformBuffer

SHORTEST = SynchronisationSettings(history_steps=1, horizon_s=1e-9)
"""The windows of the shortest rows: what makes none of these makes none at all."""
_USUAL_BASES: Final = ("base_link", "base_footprint", "body", "base")
_FORWARD: Final = (-1.5707963, 0.0, -1.5707963)


@dataclass(frozen=True)
class Evidence:
    """One recording under one robot.

    ``robot`` is None where a topic that rows need is missing. ``planned`` is None where no rows can
    be made, for the reason ``fault``; ``shortest`` tells how many of the shortest rows there are
    where the usual windows leave none. ``transforms`` are those of tf by the recorder's time.
    """

    survey: Survey
    choice: TopicChoice
    robot: Robot | None
    transforms: TransformBuffer
    findings: tuple[Finding, ...] = ()
    tracks: Tracks | None = None
    planned: SynchronisedRecording | None = None
    shortest: int = 0
    fault: str | None = None
    placeholders: frozenset[str] = field(default_factory=frozenset)
    """Keys of the guessed manifest whose value is a stand-in."""

    @property
    def base_frame(self) -> str:
        """The base of the robot that was asked for."""
        return self.choice.base_frame if self.robot is None else self.robot.base_frame

    def topic(self, role: Role) -> TopicSurvey | None:
        """What was seen of the topic that serves a role; None where there is none."""
        return self.survey.topics.get(self.choice.topics.get(role, ""))


def gather_evidence(
    recording: Recording,
    survey: Survey,
    robot: Robot | None,
    settings: SynchronisationSettings | None = None,
) -> Evidence:
    """Ask the planner of rows about a recording.

    Args:
        recording: Open.
        survey: What was seen of it.
        robot: Its manifest; None guesses one.
        settings: Windows of a row; None for the usual ones.
    """
    choice = guessed_topics(survey) if robot is None else declared_topics(robot)
    nothing = TransformBuffer({})
    needed = NEEDED[:2] if robot is not None and robot.by_lidar else NEEDED
    odometry = choice.topics.get("odometry")
    others = tuple(other_motion(recording, survey, odometry))
    if not all(choice.topics.get(role) in recording.topics for role in needed):
        others = tuple(other_motion(recording, survey, None))
        return Evidence(survey, choice, robot, nothing, others)
    assumed, findings = robot or _first_draft(choice), list[Finding]()
    try:
        tracks = read_all_tracks(recording, assumed, findings)
    except RecordingError as error:
        return Evidence(survey, choice, assumed, nothing, others, fault=str(error))
    transforms = plain_transforms(tracks)
    placeholders = frozenset[str]()
    if robot is None:
        assumed, placeholders = _second_draft(assumed, tracks, transforms)
    return _asked(
        Evidence(
            survey,
            choice,
            assumed,
            transforms,
            tracks=tracks,
            findings=(*others, *findings),
            placeholders=placeholders,
        ),
        assumed,
        tracks,
        settings or SynchronisationSettings(),
    )


def plain_transforms(tracks: Tracks) -> TransformBuffer:
    """The transforms of tf and of the odometry topic by the recorder's time."""
    edges = sort_edges(tracks.edges)
    moving = {edge: moving_edge(track, track.stamps.bag_ns) for edge, track in edges.moving.items()}
    odometry = tracks.odometry
    if odometry is not None and odometry.frame and odometry.child_frame:
        edge = (odometry.frame, odometry.child_frame)
        if odometry.frame != odometry.child_frame and not {edge, edge[::-1]} & moving.keys():
            moving[edge] = _one_sample(odometry)
    return TransformBuffer(edges.fixed_edges(lambda track: track.stamps.bag_ns), moving)


def _one_sample(odometry: MotionTrack) -> MovingEdge:
    """That two frames move against each other, if not how."""
    first = odometry.stamps.bag_ns[:1]
    unit = np.array([[0.0, 0.0, 0.0, 1.0]])
    return MovingEdge(first, np.zeros((1, 3)), unit, np.zeros(1, np.int64))


def _asked(
    evidence: Evidence, robot: Robot, tracks: Tracks, settings: SynchronisationSettings
) -> Evidence:
    findings = list(evidence.findings)
    changes: dict[str, object] = {}
    try:
        planned = synchronise_tracks(tracks, robot, ClockSettings(), settings, findings)
        changes = {"planned": planned}
        if not planned.plan.rows:
            short = synchronise_tracks(tracks, robot, ClockSettings(), SHORTEST, [])
            changes["shortest"] = short.plan.rows
    except RecordingError as error:
        changes = {"fault": str(error)}
    return Evidence(**{**vars(evidence), "findings": tuple(findings), **changes})


def _first_draft(choice: TopicChoice) -> Robot:
    """Topics and frames alone, in a robot that may do anything."""
    names = {role: topic for role, topic in choice.topics.items() if topic}
    return Robot(
        name="guess",
        topics=Topics.model_validate(names),
        base_frame=choice.base_frame,
        odometry_frame=choice.odometry_frame,
        limits=Limits(linear_velocity=(-1e3, 1e3), yaw_rate=(-1e3, 1e3)),
        footprint=Footprint(length=1.0, width=0.6),
    )


def _second_draft(
    draft: Robot, tracks: Tracks, transforms: TransformBuffer
) -> tuple[Robot, frozenset[str]]:
    """With limits by what was driven, and stand-ins for what nothing tells."""
    base = _base_frame(draft, tracks, transforms)
    camera, lidar, stand_ins = Camera(), Lidar(), set[str]()
    optical = _optical_frame(base, tracks.image_frame, transforms)
    if optical is not None:
        camera = Camera(frame=optical)
    if not transforms.connects(base, tracks.image_frame) or not transforms.is_fixed(
        base, tracks.image_frame
    ):
        camera = Camera(mounting=Mounting(translation=(0, 0, 0), rotation_rpy=_FORWARD))
        stand_ins.add("camera.mounting")
    if not transforms.connects(base, tracks.points_frame):
        lidar = Lidar(mounting=Mounting(translation=(0, 0, 0)))
        stand_ins.add("lidar.mounting")
    if tracks.calibration is None:
        unknown = Intrinsics(width=640, height=480, fx=320, fy=320, cx=319.5, cy=239.5)
        camera = camera.model_copy(update={"intrinsics": unknown})
        stand_ins.add("camera.intrinsics")
    update = {"base_frame": base, "camera": camera, "lidar": lidar}
    placed = draft.model_copy(update=update)
    return placed.model_copy(update={"limits": _limits(placed, tracks)}), frozenset(stand_ins)


def _optical_frame(base: str, frame: str, transforms: TransformBuffer) -> str | None:
    """The optical frame to take in place of a camera's body frame; None where that is none."""
    if not transforms.connects(base, frame) or not transforms.is_fixed(base, frame):
        return None
    if not is_body_frame(transforms.changes(base, frame)[-1][1].rotation):
        return None
    likely = likely_optical(frame, transforms.frames)
    fixed = likely is not None and transforms.connects(base, likely)
    return likely if fixed and likely and transforms.is_fixed(base, likely) else None


def _base_frame(draft: Robot, tracks: Tracks, transforms: TransformBuffer) -> str:
    """The odometry's child frame, or a usual base that is fixed to it."""
    child = tracks.odometry.child_frame if tracks.odometry else draft.base_frame
    if child and (child in _USUAL_BASES or child.rpartition("/")[2].startswith("base")):
        return child
    for base in _USUAL_BASES:
        if not child and base in transforms.frames:
            return base
        if child and transforms.connects(base, child) and transforms.is_fixed(base, child):
            return base
    return child or draft.base_frame


def _limits(draft: Robot, tracks: Tracks) -> Limits:
    try:
        track = tracks.odometry or odometry_from_tf(sort_edges(tracks.edges), draft)
    except RecordingError:
        return draft.limits
    return driven_limits(track)
