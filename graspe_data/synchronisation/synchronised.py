"""A recording whose topics are on one clock and whose rows are planned."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from graspe_data.arrays import Floats, Stamps
from graspe_data.observation.odometry_series import PoseSeries
from graspe_data.recordings.recording import Recording
from graspe_data.robot import Robot
from graspe_data.synchronisation.camera_check import check_camera
from graspe_data.synchronisation.clocks import ClockSettings, Timeline
from graspe_data.synchronisation.command_agreement import check_commands
from graspe_data.synchronisation.edges import sort_edges
from graspe_data.synchronisation.findings import Finding
from graspe_data.synchronisation.first_pass import read_tracks
from graspe_data.synchronisation.odometry import build_odometry, child_from_base
from graspe_data.synchronisation.odometry_by_lidar import with_lidar_odometry
from graspe_data.synchronisation.placement import Placement
from graspe_data.synchronisation.recording_transforms import recording_transforms
from graspe_data.synchronisation.row_plan import (
    RowPlan,
    SynchronisationSettings,
    join_plans,
    plan_rows,
)
from graspe_data.synchronisation.timed_recording import time_recording
from graspe_data.synchronisation.timed_stretch import TimedStretch
from graspe_data.synchronisation.tracks import InertialTrack, MotionTrack, Tracks


@dataclass(frozen=True)
class TimedValues:
    """Numbers of a topic in time: int64 ns (N,) and float64 (N, D), in the reader's order."""

    stamps_ns: Stamps
    values: Floats


@dataclass(frozen=True)
class SynchronisedRecording:
    """Tracks on the camera's clock, and the rows that they make.

    Stamps are those of the camera, but where a stretch would begin before the one before ended: it
    is moved on, by ``shifts_ns`` (S,), so that one axis holds the whole recording. ``points_ns``
    (C,) are the times of the clouds with the ordinals ``points_ordinal``.
    """

    tracks: Tracks
    points_ns: Stamps
    points_ordinal: Stamps
    odometry: PoseSeries
    command: TimedValues | None
    imu: TimedValues | None
    placement: Placement
    plan: RowPlan
    offsets_ns: Mapping[str, int]
    shifts_ns: tuple[int, ...]
    findings: tuple[Finding, ...]


def synchronise(
    recording: Recording,
    robot: Robot,
    clocks: ClockSettings,
    settings: SynchronisationSettings,
    findings: list[Finding] | None = None,
) -> SynchronisedRecording:
    """Read all stamps and motion of a recording and plan its rows.

    Args:
        recording: Open.
        robot: Its manifest.
        clocks: Limits of clocks.
        settings: Rates, windows, tolerances.
        findings: Is told what was found, also where the recording is refused.

    Raises:
        RecordingError: Topics are missing, clocks are unrelated, sources contradict each other,
            there is no odometry, or nothing tells where a sensor is or how the camera sees.
    """
    collected = findings if findings is not None else []
    tracks = read_all_tracks(recording, robot, collected)
    return synchronise_tracks(tracks, robot, clocks, settings, collected)


def read_all_tracks(recording: Recording, robot: Robot, findings: list[Finding]) -> Tracks:
    """Read the tracks of a recording; of one without odometry, make it from the clouds.

    Raises:
        RecordingError: As ``read_tracks``; or KISS-ICP is not installed.
    """
    tracks = read_tracks(recording, robot)
    return with_lidar_odometry(recording, tracks, robot, findings) if robot.by_lidar else tracks


def synchronise_tracks(
    tracks: Tracks,
    robot: Robot,
    clocks: ClockSettings,
    settings: SynchronisationSettings,
    findings: list[Finding],
) -> SynchronisedRecording:
    """Plan the rows of tracks that were read before; as ``synchronise`` otherwise."""
    edges = sort_edges(tracks.edges, tracks.unusable_edges)
    findings += edges.findings
    topic = robot.topics.points
    findings += [Finding("lidar_packets", "noted", topic, text) for text in tracks.lidar_notes]
    whole = time_recording(tracks, edges, robot, clocks, findings)
    transforms = recording_transforms(edges, whole, robot, clocks, findings)
    placement = Placement(robot, transforms)
    placement.check(tracks.image_frame, tracks.points_frame)
    findings += placement.findings(tracks.image_frame, tracks.points_frame)
    findings += check_camera(tracks, placement)
    stretches = whole.timed
    odometry = build_odometry(
        [stretch.samples for stretch in stretches],
        robot,
        child_from_base(stretches[0].odometry, placement, findings),
        findings,
    )
    command = _values([(s.command_time, s.tracks.command) for s in stretches])
    findings += check_commands(command, odometry, robot)
    plans = [_planned(stretch, odometry, placement, settings) for stretch in stretches]
    return SynchronisedRecording(
        tracks=tracks,
        points_ns=np.concatenate([stretch.points.stamps_ns for stretch in stretches]),
        points_ordinal=np.concatenate([stretch.tracks.points.ordinal for stretch in stretches]),
        odometry=odometry,
        command=command,
        imu=_values([(s.imu_time, s.tracks.imu) for s in stretches]),
        placement=placement,
        plan=join_plans([*plans, *whole.without_rows(settings)]),
        offsets_ns=_offsets(stretches[0]),
        shifts_ns=whole.shifts_ns,
        findings=tuple(findings),
    )


def _planned(
    stretch: TimedStretch,
    odometry: PoseSeries,
    placement: Placement,
    settings: SynchronisationSettings,
) -> RowPlan:
    """The rows of one stretch; messages by the ordinals of their topics."""
    image, points = stretch.image.stamps_ns, stretch.points.stamps_ns
    own = _within(odometry, stretch)
    frame = stretch.tracks.points_frame
    plan = plan_rows(image, points, own, settings, placement.known(frame, points))
    clouds = np.where(plan.points >= 0, stretch.tracks.points.ordinal[plan.points], -1)
    return replace(plan, image=stretch.tracks.image.ordinal[plan.image], points=clouds)


def _within(odometry: PoseSeries, stretch: TimedStretch) -> PoseSeries:
    """The odometry of one stretch."""
    first, last = (int(stretch.samples.stamps_ns[k]) for k in (0, -1))
    begin, end = np.searchsorted(odometry.stamps_ns, [first, last + 1])
    part = slice(int(begin), int(end))
    return PoseSeries(
        odometry.stamps_ns[part],
        odometry.pose[part],
        odometry.velocity[part],
        odometry.segment[part],
    )


def _values(
    parts: Sequence[tuple[Timeline | None, MotionTrack | InertialTrack | None]],
) -> TimedValues | None:
    """An optional topic of all stretches: v and omega, or gyro and acceleration."""
    there = [(time, track) for time, track in parts if time is not None and track is not None]
    if not there:
        return None
    tables = [
        track.twist[:, [0, 5]]
        if isinstance(track, MotionTrack)
        else np.concatenate([track.gyro, track.acceleration], axis=1)
        for _, track in there
    ]
    if len(there) == 1:
        return TimedValues(there[0][0].stamps_ns, tables[0])
    stamps = np.concatenate([time.stamps_ns for time, _ in there])
    return TimedValues(stamps, np.concatenate(tables))


def _offsets(stretch: TimedStretch) -> dict[str, int]:
    """What was added to each topic's stamps."""
    times = (
        stretch.image,
        stretch.points,
        stretch.odometry_time,
        stretch.command_time,
        stretch.imu_time,
    )
    return {time.topic: time.offset_ns for time in times if time is not None}
