"""The motion of a recording between stages: odometry, commands and IMU samples in time order."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from graspe_data.observation.labels import (
    CommandSeries,
    InertialSeries,
    MotionSeries,
    OdometrySeries,
)
from graspe_data.shards.aligned_npz import map_npz, write_npz
from graspe_data.synchronisation.clocks import Timeline
from graspe_data.synchronisation.synchronised import SynchronisedRecording

MOTION_FILE = "motion.npz"
Arrays = Mapping[str, NDArray[np.generic]]


def motion_series(synchronised: SynchronisedRecording) -> MotionSeries:
    """What the label rules look at, from a synchronised recording.

    Roll and pitch are left out where the odometry is planar. A quantity that the IMU does not
    measure at all is zero, so that the other still counts.
    """
    odometry, tracks = synchronised.odometry, synchronised.tracks
    x, y, _, roll, pitch, yaw = odometry.pose.T
    tilts = bool(np.any(roll) or np.any(pitch))
    v, omega = odometry.velocity.T
    series = OdometrySeries(
        odometry.stamps_ns,
        x,
        y,
        yaw,
        v,
        omega,
        roll if tilts else None,
        pitch if tilts else None,
    )
    command = inertial = None
    if tracks.command is not None and synchronised.command_time is not None:
        stamps, (v, omega) = _in_time(synchronised.command_time, *tracks.command.velocity.T)
        command = CommandSeries(stamps, v, omega)
    if tracks.imu is not None and synchronised.imu_time is not None:
        quantities = _measured(tracks.imu.gyro), _measured(tracks.imu.acceleration)
        stamps, (gyro, accel) = _in_time(synchronised.imu_time, *quantities)
        inertial = InertialSeries(stamps, gyro, accel)
    return MotionSeries(series, command, inertial)


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
    table = np.concatenate(
        [value.reshape(len(value), math.prod(value.shape[1:])) for value in values], axis=1
    )[first]
    finite = np.isfinite(table).all(axis=1)
    return stamps[finite], [value[first][finite] for value in values]


def _measured(values: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.zeros_like(values) if np.isnan(values).all() else values
