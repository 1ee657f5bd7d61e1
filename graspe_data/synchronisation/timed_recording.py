"""A recording cut where its stamps begin again, each stretch on the camera's clock."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from graspe_data.arrays import Stamps
from graspe_data.errors import RecordingError
from graspe_data.robot import Robot
from graspe_data.synchronisation.clock_agreement import late_sensors, measured_offsets, set_clocks
from graspe_data.synchronisation.clocks import ClockSettings
from graspe_data.synchronisation.edges import Edges
from graspe_data.synchronisation.findings import Finding
from graspe_data.synchronisation.odometry_from_tf import moving_edge_of
from graspe_data.synchronisation.row_plan import RowPlan, SynchronisationSettings, lost_rows
from graspe_data.synchronisation.stretches import (
    SECOND,
    Order,
    find_cuts,
    recording_order,
    stay_apart,
    stretch_of,
)
from graspe_data.synchronisation.timed_stretch import (
    Part,
    TimedStretch,
    split_tracks,
    time_stretch,
)
from graspe_data.synchronisation.tracks import EdgeTrack, Tracks


@dataclass(frozen=True)
class TimedRecording:
    """The stretches in order; those of which no rows can be made are None, with the reason.

    ``order`` and ``cuts`` tell which stretch a message belongs to.
    """

    stretches: tuple[TimedStretch | None, ...]
    parts: tuple[Part, ...]
    faults: tuple[str, ...]
    order: Order
    cuts: tuple[int, ...]

    @property
    def timed(self) -> list[TimedStretch]:
        """The stretches that may make rows; one at least."""
        return [stretch for stretch in self.stretches if stretch is not None]

    @property
    def shifts_ns(self) -> tuple[int, ...]:
        """What was added to the stamps of each stretch."""
        return tuple(0 if s is None else s.shift_ns for s in self.stretches)

    def without_rows(self, settings: SynchronisationSettings) -> list[RowPlan]:
        """The plans of the stretches that make none."""
        lost = [
            (part.tracks.image.bag_ns, fault)
            for part, fault, stretch in zip(self.parts, self.faults, self.stretches, strict=True)
            if stretch is None
        ]
        return [lost_rows(image_ns, settings, fault) for image_ns, fault in lost]

    def when_it_came(self, track: EdgeTrack) -> Stamps:
        """When the messages of a fixed edge came, by the camera's clock of their stretch."""
        number = stretch_of(track.stamps, self.order, self.cuts)
        times = np.full(number.size, np.iinfo(np.int64).min)
        for index, stretch in enumerate(self.stretches):
            if stretch is not None:
                skew = stretch.tracks.image.bag_ns - stretch.image.stamps_ns
                usual = int(skew[0]) + int(np.median(skew - skew[0]))
                own = number == index
                times[own] = track.stamps.bag_ns[own] - usual
        return times


def time_recording(
    tracks: Tracks, edges: Edges, robot: Robot, limits: ClockSettings, findings: list[Finding]
) -> TimedRecording:
    """Cut a recording into stretches and bring each onto the camera's clock.

    Raises:
        RecordingError: No stretch can make rows; the text is that of the longest.
    """
    odometry = tracks.odometry.stamps if tracks.odometry else moving_edge_of(edges, robot).stamps
    leading = (tracks.image, tracks.points, odometry)
    order = recording_order(leading)
    cuts = find_cuts(leading, order)
    parts = split_tracks(tracks, edges, robot, order, cuts)
    timed = [_timed(part, robot, limits) for part in parts]
    stretches = [stretch for stretch, _ in timed]
    if any(stretches):
        faulty = set_clocks(stretches, limits)
        timed = [
            (None, fault) if fault else kept for kept, fault in zip(timed, faulty, strict=True)
        ]
        stretches = [stretch for stretch, _ in timed]
    if not any(stretches):
        longest = max(range(len(parts)), key=lambda k: parts[k].tracks.image.bag_ns.size)
        raise RecordingError(timed[longest][1])
    kept = _apart(stretches)
    faults = tuple(fault for _, fault in timed)
    findings += _findings(kept, faults)
    first = next(s for s in kept if s is not None)
    findings += [*measured_offsets(first, robot), *late_sensors(first)]
    return TimedRecording(tuple(kept), tuple(parts), faults, order, tuple(cuts))


def _timed(part: Part, robot: Robot, limits: ClockSettings) -> tuple[TimedStretch | None, str]:
    try:
        return time_stretch(part, robot, limits), ""
    except RecordingError as error:
        return None, str(error)


def _apart(stretches: Sequence[TimedStretch | None]) -> list[TimedStretch | None]:
    present = [stretch for stretch in stretches if stretch is not None]
    shifts = stay_apart([s.first_ns for s in present], [s.last_ns for s in present])
    moved = iter([s.shifted(shift) for s, shift in zip(present, shifts, strict=True)])
    return [None if stretch is None else next(moved) for stretch in stretches]


def _findings(stretches: Sequence[TimedStretch | None], faults: Sequence[str]) -> list[Finding]:
    if len(stretches) == 1:
        return []
    lasts = [0.0 if s is None else (s.last_ns - s.first_ns) / SECOND for s in stretches]
    spans = ", ".join(f"{seconds:.1f}" for seconds in lasts)
    text = (
        f"stamps begin again: {len(stretches)} stretches of {spans} s; nothing is paired or "
        f"interpolated across"
    )
    moved = [s.shift_ns / SECOND for s in stretches if s is not None and s.shift_ns]
    if moved:
        by = ", ".join(f"{seconds:.3f}" for seconds in moved)
        text += f"; stamps that would stand twice are moved on by {by} s"
    found = [Finding("stamps_begin_again", "mended", "", text, {"stretches": len(stretches)})]
    found += [
        Finding("stretch_without_rows", "noted", f"stretch {k + 1}", f"stretch {k + 1}: {fault}")
        for k, fault in enumerate(faults)
        if fault
    ]
    return found
