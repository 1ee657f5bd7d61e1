"""The transforms of a recording on its time axis: the edges of tf and of the odometry topic."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from graspe_data.errors import RecordingError
from graspe_data.geometry import quaternion_from_rotation, rotation_from_quaternion
from graspe_data.robot import Robot
from graspe_data.synchronisation.clocks import ClockSettings, camera_timeline, timeline
from graspe_data.synchronisation.edges import Edges
from graspe_data.synchronisation.findings import Finding
from graspe_data.synchronisation.motion_samples import MotionSamples
from graspe_data.synchronisation.odometry_from_tf import moving_edge
from graspe_data.synchronisation.pose_jumps import leaping
from graspe_data.synchronisation.timed_recording import TimedRecording
from graspe_data.synchronisation.timed_stretch import TimedStretch
from graspe_data.synchronisation.tracks import EdgeTrack
from graspe_data.synchronisation.transform_buffer import Edge, MovingEdge, TransformBuffer


def recording_transforms(
    edges: Edges,
    whole: TimedRecording,
    robot: Robot,
    limits: ClockSettings,
    findings: list[Finding],
) -> TransformBuffer:
    """Build the buffer.

    Args:
        edges: Of the whole recording.
        whole: Its stretches on one time axis.
        robot: Its clocks: tf is stamped by that of the odometry.
        limits: Of clocks.
        findings: Is told which edges are left out.
    """
    moving: dict[Edge, list[MovingEdge]] = {}
    for number, (stretch, own) in enumerate(zip(whole.timed, _axes(whole.timed), strict=True)):
        for edge, track in stretch.edges.moving.items():
            try:
                timed = _on_axis(track, stretch, robot, limits, number)
                moving.setdefault(edge, []).append(_within(timed, own))
            except RecordingError as error:
                text = f"{track.name} is left out: {error}"
                findings.append(Finding("edge_on_other_clock", "noted", track.name, text))
    joined = {edge: _joined(parts) for edge, parts in moving.items() if parts}
    joined = {edge: track for edge, track in joined.items() if track.stamps_ns.size}
    for edge, by_topic in _topic_edges(whole.timed).items():
        if not {edge, edge[::-1]} & joined.keys():
            joined[edge] = by_topic
    return TransformBuffer(edges.fixed_edges(whole.when_it_came), joined)


def _on_axis(
    track: EdgeTrack, stretch: TimedStretch, robot: Robot, limits: ClockSettings, number: int
) -> MovingEdge:
    camera = stretch.tracks.image
    time = timeline(
        track.stamps,
        robot.clocks.odometry,
        camera,
        camera_timeline(camera, robot.clocks.image),
        limits,
    )
    edge = moving_edge(track, time.stamps_ns + stretch.shift_ns)
    rotation = rotation_from_quaternion(edge.quaternion)
    leaps = leaping(edge.stamps_ns, edge.translation, rotation, robot.limits)
    segment = np.concatenate([[0], np.cumsum(leaps)]) + (number << 32)
    return replace(edge, segment=segment)


def _axes(stretches: Sequence[TimedStretch]) -> list[tuple[int, int]]:
    """Between which times, exclusive, the edges of each stretch are its own.

    Transforms may be stamped long before the sensors' first messages and after their last.
    """
    firsts = [stretch.first_ns for stretch in stretches]
    lasts = [stretch.last_ns for stretch in stretches]
    ends = np.iinfo(np.int64)
    return list(zip([ends.min, *lasts[:-1]], [*firsts[1:], ends.max], strict=True))


def _within(edge: MovingEdge, axis: tuple[int, int]) -> MovingEdge:
    own = (edge.stamps_ns > axis[0]) & (edge.stamps_ns < axis[1])
    return MovingEdge(
        edge.stamps_ns[own], edge.translation[own], edge.quaternion[own], edge.segment[own]
    )


def _joined(parts: Sequence[MovingEdge]) -> MovingEdge:
    return MovingEdge(
        np.concatenate([part.stamps_ns for part in parts]),
        np.concatenate([part.translation for part in parts]),
        np.concatenate([part.quaternion for part in parts]),
        np.concatenate([part.segment for part in parts]),
    )


def _topic_edges(stretches: Sequence[TimedStretch]) -> dict[Edge, MovingEdge]:
    """The odometry topic's own poses as an edge, where they are poses."""
    found: dict[Edge, list[MovingEdge]] = {}
    for number, stretch in enumerate(stretches):
        odometry, samples = stretch.odometry, stretch.samples
        frame, child = odometry.frame, odometry.child_frame
        if frame and child and frame != child and _tells(samples):
            edge = MovingEdge(
                samples.stamps_ns,
                samples.position,
                quaternion_from_rotation(samples.rotation),
                samples.segment + (number << 32),
            )
            found.setdefault((frame, child), []).append(edge)
    return {edge: _joined(parts) for edge, parts in found.items()}


def _tells(samples: MotionSamples) -> bool:
    """Whether there are poses, and they were ever filled."""
    if not np.isfinite(samples.rotation).all():
        return False
    return bool(np.ptp(samples.position, axis=0).any() or np.ptp(samples.rotation, axis=0).any())
