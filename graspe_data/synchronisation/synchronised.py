"""A recording whose topics are on one clock and whose rows are planned."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from graspe_data.observation.odometry_series import PoseSeries
from graspe_data.recordings.recording import Recording
from graspe_data.robot import Clock, Robot
from graspe_data.synchronisation.clocks import ClockSettings, Timeline, camera_timeline, timeline
from graspe_data.synchronisation.first_pass import read_tracks
from graspe_data.synchronisation.odometry import pose_series
from graspe_data.synchronisation.row_plan import RowPlan, SynchronisationSettings, plan_rows
from graspe_data.synchronisation.tracks import InertialTrack, MotionTrack, StampTrack, Tracks


@dataclass(frozen=True)
class SynchronisedRecording:
    """Tracks on the camera's clock, and the rows that they make."""

    tracks: Tracks
    image: Timeline
    points: Timeline
    odometry_time: Timeline
    command_time: Timeline | None
    imu_time: Timeline | None
    odometry: PoseSeries
    plan: RowPlan

    @property
    def offsets_ns(self) -> dict[str, int]:
        """What was added to each topic's stamps."""
        times = (self.image, self.points, self.odometry_time, self.command_time, self.imu_time)
        return {time.topic: time.offset_ns for time in times if time is not None}


def synchronise(
    recording: Recording, robot: Robot, clocks: ClockSettings, settings: SynchronisationSettings
) -> SynchronisedRecording:
    """Read all stamps and motion of a recording and plan its rows.

    Raises:
        RecordingError: Topics are missing, clocks are unrelated, or there is no odometry.
    """
    tracks = read_tracks(recording, robot)
    image = camera_timeline(tracks.image, robot.clocks.image)

    def on_camera_clock(track: StampTrack, clock: Clock) -> Timeline:
        return timeline(track, clock, tracks.image, image, clocks)

    def optional(track: MotionTrack | InertialTrack | None, clock: Clock) -> Timeline | None:
        return None if track is None else on_camera_clock(track.stamps, clock)

    points = on_camera_clock(tracks.points, robot.clocks.points)
    odometry_time = on_camera_clock(tracks.odometry.stamps, robot.clocks.odometry)
    odometry = pose_series(tracks.odometry, odometry_time)
    planned = plan_rows(image.stamps_ns, points.stamps_ns, odometry, settings)
    clouds = np.where(planned.points >= 0, tracks.points.ordinal[planned.points], -1)
    return SynchronisedRecording(
        tracks=tracks,
        image=image,
        points=points,
        odometry_time=odometry_time,
        command_time=optional(tracks.command, robot.clocks.command),
        imu_time=optional(tracks.imu, robot.clocks.imu),
        odometry=odometry,
        plan=replace(planned, image=tracks.image.ordinal[planned.image], points=clouds),
    )
