"""One stretch of a recording on the camera's clock."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from graspe_data.arrays import Mask
from graspe_data.errors import RecordingError
from graspe_data.robot import Clock, Robot
from graspe_data.synchronisation.clocks import ClockSettings, Timeline, camera_timeline, timeline
from graspe_data.synchronisation.edges import Edges
from graspe_data.synchronisation.motion_samples import MotionSamples, motion_samples
from graspe_data.synchronisation.odometry_from_tf import odometry_from_tf
from graspe_data.synchronisation.pose_jumps import cut_at_jumps
from graspe_data.synchronisation.stretches import Order, stretch_of
from graspe_data.synchronisation.tracks import InertialTrack, MotionTrack, StampTrack, Tracks


@dataclass(frozen=True)
class Part:
    """The messages of one stretch, and the odometry and the moving edges among them."""

    tracks: Tracks
    odometry: MotionTrack
    edges: Edges


@dataclass(frozen=True)
class TimedStretch:
    """A stretch whose topics are on one clock; ``samples`` is the odometry's child frame."""

    tracks: Tracks
    odometry: MotionTrack
    edges: Edges
    image: Timeline
    points: Timeline
    odometry_time: Timeline
    command_time: Timeline | None
    imu_time: Timeline | None
    samples: MotionSamples
    shift_ns: int = 0
    """What was added to all stamps so that no stretch begins before the one before ended."""

    @property
    def first_ns(self) -> int:
        """The earliest stamp that makes rows."""
        return min(int(time.stamps_ns.min()) for time in self._times)

    @property
    def last_ns(self) -> int:
        """The latest one."""
        return max(int(time.stamps_ns.max()) for time in self._times)

    @property
    def _times(self) -> tuple[Timeline, Timeline, Timeline]:
        return self.image, self.points, self.odometry_time

    def shifted(self, shift_ns: int) -> TimedStretch:
        """The stretch later on the axis of the recording."""

        def later(time: Timeline | None) -> Timeline | None:
            return None if time is None else time.shifted(shift_ns)

        stamps = self.samples.stamps_ns + shift_ns
        return replace(
            self,
            image=self.image.shifted(shift_ns),
            points=self.points.shifted(shift_ns),
            odometry_time=self.odometry_time.shifted(shift_ns),
            command_time=later(self.command_time),
            imu_time=later(self.imu_time),
            samples=replace(self.samples, stamps_ns=stamps),
            shift_ns=shift_ns,
        )


def split_tracks(
    tracks: Tracks, edges: Edges, robot: Robot, order: Order, cuts: Sequence[int]
) -> list[Part]:
    """The messages of each stretch; fixed edges and the calibration belong to all.

    Raises:
        RecordingError: Odometry is to be made of tf, which does not tell it.
    """
    return [_part(tracks, edges, robot, order, cuts, number) for number in range(len(cuts) + 1)]


def time_stretch(part: Part, robot: Robot, limits: ClockSettings) -> TimedStretch:
    """Bring the topics of a stretch onto the camera's clock.

    Raises:
        RecordingError: A topic that rows need has no message in it, or clocks are unrelated.
    """
    tracks, odometry, clocks = part.tracks, part.odometry, robot.clocks
    for track in (tracks.image, tracks.points, odometry.stamps):
        if not track.bag_ns.size:
            raise RecordingError(f"no message on {track.topic} in this stretch of the recording.")
    image = camera_timeline(tracks.image, clocks.image)

    def on_camera_clock(track: StampTrack, clock: Clock) -> Timeline:
        return timeline(track, clock, tracks.image, image, limits)

    def optional(track: MotionTrack | InertialTrack | None, clock: Clock) -> Timeline | None:
        if track is None or not track.stamps.bag_ns.size:
            return None
        return on_camera_clock(track.stamps, clock)

    odometry_time = on_camera_clock(odometry.stamps, clocks.odometry)
    return TimedStretch(
        tracks=tracks,
        odometry=odometry,
        edges=part.edges,
        image=image,
        points=on_camera_clock(tracks.points, clocks.points),
        odometry_time=odometry_time,
        command_time=optional(tracks.command, clocks.command),
        imu_time=optional(tracks.imu, clocks.imu),
        samples=cut_at_jumps(motion_samples(odometry, odometry_time.stamps_ns), robot.limits),
    )


def _part(
    tracks: Tracks, edges: Edges, robot: Robot, order: Order, cuts: Sequence[int], number: int
) -> Part:
    def kept(track: StampTrack) -> Mask:
        return np.asarray(stretch_of(track, order, cuts) == number)

    def motion(track: MotionTrack | None) -> MotionTrack | None:
        return None if track is None else track.only(kept(track.stamps))

    own = replace(
        tracks,
        image=tracks.image.only(kept(tracks.image)),
        points=tracks.points.only(kept(tracks.points)),
        odometry=motion(tracks.odometry),
        command=motion(tracks.command),
        imu=None if tracks.imu is None else tracks.imu.only(kept(tracks.imu.stamps)),
    )
    its_edges = edges.only(lambda edge: kept(edge.stamps))
    odometry = own.odometry
    if odometry is None:
        odometry = odometry_from_tf(its_edges, robot)
    return Part(own, odometry, its_edges)
