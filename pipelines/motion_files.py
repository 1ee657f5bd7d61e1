"""The motion of a recording between stages: odometry, commands and IMU samples in time order."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from graspe_data.errors import GeometryError
from graspe_data.observation.labels import (
    CommandSeries,
    InertialSeries,
    MotionSeries,
    OdometrySeries,
)
from graspe_data.recordings.clocks import Timeline
from graspe_data.recordings.synchronised import SynchronisedRecording
from graspe_data.recordings.tracks import InertialTrack, Tracks
from graspe_data.shards.aligned_npz import map_npz, write_npz

MOTION_FILE = "motion.npz"
Arrays = Mapping[str, NDArray[np.generic]]


def motion_series(synchronised: SynchronisedRecording, base_frame: str) -> MotionSeries:
    """What the label rules look at, from a synchronised recording."""
    odometry, tracks = synchronised.odometry, synchronised.tracks
    x, y, _, roll, pitch, yaw = odometry.pose.T
    command = inertial = None
    if tracks.command is not None and synchronised.command_time is not None:
        stamps, (v, omega) = _in_time(synchronised.command_time, *tracks.command.velocity.T)
        command = CommandSeries(stamps, v, omega)
    if tracks.imu is not None and synchronised.imu_time is not None:
        rotation = _base_from_imu(tracks, tracks.imu, base_frame)
        stamps, (gyro, accel) = _in_time(
            synchronised.imu_time,
            tracks.imu.gyro @ rotation.T,
            tracks.imu.acceleration @ rotation.T,
        )
        inertial = InertialSeries(stamps, gyro, accel)
    v, omega = odometry.velocity.T
    return MotionSeries(
        OdometrySeries(odometry.stamps_ns, x, y, yaw, v, omega, roll, pitch), command, inertial
    )


def write_motion(folder: Path, series: MotionSeries) -> str:
    """Write a recording's motion beside its columns; returns the SHA-256 of the file."""
    arrays: dict[str, NDArray[np.generic]] = {}
    for part in ("odometry", "command", "inertial"):
        values = getattr(series, part)
        for name, array in vars(values).items() if values is not None else ():
            if array is not None:
                arrays[f"{part}.{name}"] = np.ascontiguousarray(array)
    write_npz(folder / MOTION_FILE, arrays)
    return hashlib.sha256((folder / MOTION_FILE).read_bytes()).hexdigest()


def read_motion(folder: Path) -> MotionSeries:
    """Read what ``write_motion`` wrote."""
    arrays = map_npz(folder / MOTION_FILE)

    def part(name: str) -> dict[str, NDArray[np.generic]]:
        prefix = f"{name}."
        return {k.removeprefix(prefix): v for k, v in arrays.items() if k.startswith(prefix)}

    command, inertial = part("command"), part("inertial")
    return MotionSeries(
        OdometrySeries(**part("odometry")),  # type: ignore[arg-type]
        CommandSeries(**command) if command else None,  # type: ignore[arg-type]
        InertialSeries(**inertial) if inertial else None,  # type: ignore[arg-type]
    )


def _in_time(
    time: Timeline, *values: NDArray[np.float64]
) -> tuple[NDArray[np.int64], list[NDArray[np.float64]]]:
    """Sort by time, keep one sample a stamp, leave out samples that are not finite."""
    stamps, first = np.unique(time.stamps_ns, return_index=True)
    table = np.concatenate([value.reshape(len(value), -1) for value in values], axis=1)[first]
    finite = np.isfinite(table).all(axis=1)
    return stamps[finite], [value[first][finite] for value in values]


def _base_from_imu(tracks: Tracks, imu: InertialTrack, base_frame: str) -> NDArray[np.float64]:
    """The rotation into base_link; none where the recording does not say how the IMU sits."""
    try:
        return tracks.frames.lookup(base_frame, imu.frame).rotation
    except GeometryError:
        return np.eye(3)
