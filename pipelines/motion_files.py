"""The motion of a recording between stages: odometry, commands and IMU samples in time order."""

from __future__ import annotations

import hashlib
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
from graspe_data.synchronisation.synchronised import SynchronisedRecording, TimedValues

MOTION_FILE = "motion.npz"
Arrays = Mapping[str, NDArray[np.generic]]


def motion_series(synchronised: SynchronisedRecording) -> MotionSeries:
    """What the label rules look at, from a synchronised recording.

    Roll and pitch are left out where the odometry is planar. A quantity that the IMU does not
    measure at all is zero, so that the other still counts.
    """
    odometry = synchronised.odometry
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
        odometry.segment if np.ptp(odometry.segment) else None,
    )
    command = inertial = None
    if synchronised.command is not None:
        stamps, values = _in_time(synchronised.command)
        command = CommandSeries(stamps, values[:, 0], values[:, 1])
    if synchronised.imu is not None:
        table = synchronised.imu.values
        measured = np.concatenate([_if_finite(table[:, :3]), _if_finite(table[:, 3:])], axis=1)
        stamps, values = _in_time(TimedValues(synchronised.imu.stamps_ns, measured))
        inertial = InertialSeries(stamps, values[:, :3], values[:, 3:])
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


def _in_time(timed: TimedValues) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Sort by time, keep one sample a stamp, leave out samples that are not finite."""
    stamps, first = np.unique(timed.stamps_ns, return_index=True)
    values = timed.values[first]
    finite = np.isfinite(values).all(axis=1)
    return stamps[finite], values[finite]


def _if_finite(values: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.zeros_like(values) if np.isnan(values).all() else values
