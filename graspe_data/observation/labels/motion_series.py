"""What the rules look at: odometry, commands and inertial samples as arrays over time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from graspe_data.arrays import Floats, Stamps
from graspe_data.errors import ObservationError


@dataclass(frozen=True)
class OdometrySeries:
    """Odometry: int64 stamps and float64 arrays, all (N,), N at least 1.

    ``x``, ``y`` metres and ``yaw`` rad (unwrapped) in the odometry frame; ``v`` m/s along body x
    and ``omega`` rad/s; ``roll`` and ``pitch`` rad, or None where the odometry is planar. Between
    samples of two segments (``segment``, int64) the poses do not go on; None for one segment.

    Raises:
        ObservationError: No samples, unequal lengths, values that are not finite, or stamps that
            do not increase strictly.
    """

    stamps_ns: Stamps
    x: Floats
    y: Floats
    yaw: Floats
    v: Floats
    omega: Floats
    roll: Floats | None = None
    pitch: Floats | None = None
    segment: Stamps | None = None

    def __post_init__(self) -> None:
        """Check the arrays."""
        if not self.stamps_ns.size:
            raise ObservationError("Odometry: no samples, so nothing can be labelled.")
        for name in ("x", "y", "yaw", "v", "omega", "roll", "pitch", "segment"):
            _check("Odometry", self.stamps_ns, name, getattr(self, name), ())

    def at(self, stamps_ns: Stamps) -> tuple[Floats, Floats, Floats, Floats, Floats]:
        """x, y, yaw, v and omega by linear interpolation; held at the ends, blind to gaps."""
        seconds = (self.stamps_ns - self.stamps_ns[0]) * 1e-9
        since_s = (stamps_ns - self.stamps_ns[0]) * 1e-9
        values = (self.x, self.y, self.yaw, self.v, self.omega)
        x, y, yaw, v, omega = (np.interp(since_s, seconds, value) for value in values)
        return x, y, yaw, v, omega


@dataclass(frozen=True)
class CommandSeries:
    """Velocity commands: int64 stamps, ``v`` m/s and ``omega`` rad/s, float64, all (N,).

    Raises:
        ObservationError: As for odometry; a series of no commands is allowed.
    """

    stamps_ns: Stamps
    v: Floats
    omega: Floats

    def __post_init__(self) -> None:
        """Check the arrays."""
        for name in ("v", "omega"):
            _check("Commands", self.stamps_ns, name, getattr(self, name), ())

    def held(self, stamps_ns: Stamps) -> tuple[Floats, Floats, Floats]:
        """The last command's v, its omega and its age in seconds; (0, 0, inf) before the first."""
        index = np.searchsorted(self.stamps_ns, stamps_ns, side="right")
        v, omega = (np.concatenate([[0.0], value])[index] for value in (self.v, self.omega))
        given = np.concatenate([stamps_ns[:1], self.stamps_ns])[index]
        return v, omega, np.where(index > 0, (stamps_ns - given) * 1e-9, np.inf)


@dataclass(frozen=True)
class InertialSeries:
    """IMU samples: int64 stamps (N,), ``gyro`` rad/s and ``accel`` m/s^2, each float64 (N, 3).

    In any axes, since the rules need no mounting: they look at lengths, and at the angle to
    gravity. Where the sensor removes gravity from ``accel``, z is taken to be up.

    Raises:
        ObservationError: As for odometry; a series of no samples is allowed.
    """

    stamps_ns: Stamps
    gyro: Floats
    accel: Floats

    def __post_init__(self) -> None:
        """Check the arrays."""
        for name in ("gyro", "accel"):
            _check("Inertial samples", self.stamps_ns, name, getattr(self, name), (3,))


@dataclass(frozen=True)
class MotionSeries:
    """One recording's motion; commands and inertial samples are None where it has no such topic."""

    odometry: OdometrySeries
    command: CommandSeries | None = None
    inertial: InertialSeries | None = None


def _check(
    where: str, stamps: Stamps, name: str, values: Floats | None, row: tuple[int, ...]
) -> None:
    if values is None:
        return
    if values.shape != (stamps.size, *row):
        expected, found = (stamps.size, *row), values.shape
        raise ObservationError(f"{where}: {name}: expected shape {expected}, found {found}.")
    finite = np.isfinite(values).all(axis=tuple(range(1, values.ndim)))
    wrong = np.flatnonzero(~finite)
    if wrong.size:
        raise ObservationError(
            f"{where}: {name}: sample {wrong[0]} at {stamps[wrong[0]]} ns is not finite; "
            "leave such samples out."
        )
    back = np.flatnonzero(np.diff(stamps) <= 0)
    if back.size:
        raise ObservationError(
            f"{where}: sample {back[0] + 1} at {stamps[back[0] + 1]} ns does not come after "
            f"the one before it ({stamps[back[0]]} ns); sort the samples and drop repeated stamps."
        )


def moving_mean(
    stamps_ns: NDArray[np.int64], values: Floats, before_s: float, after_s: float
) -> Floats:
    """Mean of the samples around each sample, its own included, in linear time.

    Args:
        stamps_ns: int64 (N,), increasing.
        values: float64 (N, ...), a row per stamp.
        before_s: How far back the window reaches; its ends are included.
        after_s: How far on it reaches.

    Returns:
        float64, of the shape of ``values``.
    """
    first = np.searchsorted(stamps_ns, stamps_ns - round(before_s * 1e9), side="left")
    after = np.searchsorted(stamps_ns, stamps_ns + round(after_s * 1e9), side="right")
    sums = np.concatenate([np.zeros((1, *values.shape[1:])), np.cumsum(values, axis=0)])
    count = (after - first).reshape(-1, *[1] * (values.ndim - 1))
    mean: Floats = (sums[after] - sums[first]) / count
    return mean


# Seconds: longer than an impact or a stride, shorter than a change of slope.
GRAVITY_WINDOW_S = 2.0


def gravity(inertial: InertialSeries) -> Floats:
    """Mean acceleration over two seconds around each sample, float64 (N, 3), m/s^2.

    It stands for gravity and for steady acceleration; near zero where the sensor removes gravity.
    """
    half = GRAVITY_WINDOW_S / 2
    return moving_mean(inertial.stamps_ns, inertial.accel, half, half)


def shock(inertial: InertialSeries, window_s: float = 0.0) -> Floats:
    """Size of the acceleration less ``gravity``, float64 (N,), m/s^2.

    Args:
        inertial: The samples.
        window_s: The acceleration is first averaged, as a vector, over this window: vibration
            cancels and a push remains. Zero takes every sample as it is.
    """
    half = window_s / 2
    smooth = moving_mean(inertial.stamps_ns, inertial.accel, half, half)
    size: Floats = np.linalg.norm(smooth - gravity(inertial), axis=1)
    return size
